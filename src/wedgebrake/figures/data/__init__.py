"""Pictures as data, before anything is drawn: one file per kind, and what they share."""
