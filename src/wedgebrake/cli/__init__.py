"""The command line: ``wedgebrake COMMAND STUDY.toml``.

main        the program and its exit codes
commands    stability, simulate, schema
changes     --set NAME=VALUE
report      a response as JSON and as words
output      what can be written where, checked before the work and written at once
waiting     a word on compilation, and an ear for Ctrl-C
"""

from wedgebrake.cli.main import main

__all__ = ["main"]
