"""The command line: ``wedgebrake COMMAND STUDY.toml``.

main       the program: exit codes, errors without tracebacks
commands   the commands, with their help; each calls its own module
options    arguments and options, with their help
app_command, compile_command, continue_command, paper_command, simulate_command, measures_command,
fit_command, sweep_command, scatter_command, rare_event_command, margin_command,
response_command, doctor, examples
           the commands app, compile, continue, paper, simulate and stability, stop with orders and
           temperature, fit, sweep, scatter, rare-event, margin and response (with their reports),
           doctor and example
stability_report, response_report, continue_report, sweep_report, sweep_text
           what a command prints: the data of --json, and the text
overrides, assignments
           the study of a command: --set, --method, --over and other options
output     reports as JSON or text; files, checked before the computation
workers    threads or processes that compute the points of a sweep
progress, compilation, interrupts, streams, garbage
           progress of sweeps and of compilation, Ctrl-C, control characters, garbage collection
"""

from wedgebrake.cli.main import process_main

__all__ = ["process_main"]
