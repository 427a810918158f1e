"""The schema of study files, and the examples of drivelines.

For tests that check many files: checking the schema itself takes longer.
"""

from pathlib import Path

import jsonschema

from wedgebrake.model.studies.study import schema

VALIDATOR = jsonschema.Draft202012Validator(schema())
# Machines have tests of their own.
DRIVELINES = [
    path
    for path in sorted((Path(__file__).parents[1] / "examples").glob("*.toml"))
    if "[[inertia]]" not in path.read_text()
]
