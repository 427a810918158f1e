"""The command line: ``wedgebrake COMMAND STUDY.toml``.

main         the program: exit codes, errors without tracebacks
commands     stability, simulate, sweep, continue, paper, app, schema, example, doctor
options      their arguments and options, with the help
overrides    the study of a command: --set, --method and the options of sweeps
ranges       --over NAME=FROM:TO:COUNT, or NAME=FROM:TO
writing      one way for all reports: a dict, printed as JSON or told as text
report       linear stability and a response, as data and as text
sweep_command, continue_command, paper_command, app_command
             the work of the long commands: checks, progress, Ctrl-C
sweep_report, continue_report
             their data
sweep_text, continue_text
             their text
examples     study files that come with wedgebrake
doctor, doctor_packages, doctor_kernels
             what is installed and compiled, and what is wrong
output       files: checked before the work, each written completely or not at all
progress     progress of a long computation
interrupts   a message on compilation, and Ctrl-C as an exception of its own
streams      standard output and error: always open, control characters escaped
"""

from wedgebrake.cli.main import main

__all__ = ["main"]
