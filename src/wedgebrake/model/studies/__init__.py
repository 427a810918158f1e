"""Study files: a system, a run and a sweep as text.

study            a system as a file, with its run
study_tables     the tables of a study file as a system, a run and a sweep
machine_study    the tables of a machine; records: CSV files that they name
tables           which part is which table
study_run        the [run] table
sweep_settings   the parameters that can be swept, and the [sweep] table
study_text       a study as text (toml: reading and writing)
study_schema     the JSON schema of study files
examples         the example study files
"""
