"""The command line: ``wedgebrake COMMAND STUDY.toml``.

main        the program and its exit codes
commands    stability, simulate, sweep, continue, paper, app, schema, example, doctor
changes     --set NAME=VALUE
over        --over NAME=FROM:TO:COUNT, or NAME=FROM:TO
report      a response as JSON and as words
x
sweep_report, sweep_text
            a sweep as JSON and as words
continuing  branches of orbits: what is asked, checked, followed
continue_report, continue_text
            them as JSON and as words
exploring   the explorer, served until Ctrl-C
watching    progress of a long computation
paper       the source's figures and audit: what is asked, progress, files, words
examples    study files that come with wedgebrake
doctor, doctor_packages, doctor_kernels
            what is installed and compiled, and what is wrong
output      what can be written where, checked before the work and written at once
waiting     a word on compilation, and an ear for Ctrl-C
streams     standard output and error: always open, control characters escaped
"""

from wedgebrake.cli.main import main

__all__ = ["main"]
