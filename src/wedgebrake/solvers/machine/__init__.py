"""The exact solver for machines of any number of inertias and contacts."""
