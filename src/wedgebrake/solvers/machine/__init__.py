"""The exact solver for machines with any number of inertias and contacts."""
