"""The schema of study files, for tests that check many: checking the schema itself takes longer."""

import jsonschema

from wedgebrake.model.studies.study import schema

VALIDATOR = jsonschema.Draft202012Validator(schema())
