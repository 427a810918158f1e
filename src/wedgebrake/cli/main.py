"""The program: commands, exit codes, and errors without tracebacks.

Exit status: 0 success, 2 invalid input, 1 any other error.
"""

from __future__ import annotations

# This module imports little, so that ``main`` handles Ctrl-C from the start.
import errno
import os
import sys
import threading
import warnings
from typing import NoReturn

from wedgebrake.cli import garbage
from wedgebrake.cli.streams import say, standard_streams


def process_main() -> None:
    """Run the command line as a process, and end the process."""
    try:
        main()
    except SystemExit as done:
        if any(thread.daemon for thread in threading.enumerate()):
            _end_process(done.code)
        raise


def main() -> None:
    """Run the command line and exit."""
    try:
        with standard_streams():
            _listening()
    except KeyboardInterrupt:  # before the handler below is installed
        _interrupted()


def _end_process(status: object) -> NoReturn:
    """Exit immediately, without the shutdown of Python: a thread may still be computing.

    The shutdown would abort the process while a kernel is compiled: LLVM calls back into Python,
    which ends such a thread within a C++ function.
    """
    os._exit(status if isinstance(status, int) else int(status is not None))


def _listening() -> None:
    """Run the command line; Ctrl-C ends it with a message."""
    from wedgebrake.cli.interrupts import Interrupted, hearing_interrupts

    try:
        with hearing_interrupts():
            _run()
    except (Interrupted, KeyboardInterrupt) as error:
        _interrupted(*_notes(error))


def _interrupted(*notes: str) -> NoReturn:
    """Exit after an interruption.

    notes : lines about results that are kept
    """
    say("\n".join(["interrupted", *notes]))
    _end_process(1)


def _run() -> None:
    from wedgebrake.errors import InputError, OutputError

    garbage.make_rare()
    warnings.showwarning = lambda message, *_, **__: say(f"warning: {message}")
    try:
        from wedgebrake.cli.commands import app

        app(prog_name="wedgebrake")
    except InputError as error:
        _stop(f"error: {error}", 2)
    except OutputError as error:
        _stop(f"error: {error}", 1)
    except MemoryError as error:
        way_out = (
            "Lower duration, periods or samples_per_period, for example with --set periods=100."
        )
        _stop(f"error: not enough memory. {' '.join(_notes(error)) or way_out}", 1)
    except OSError as error:
        _stop_at(error)
    except Exception as error:
        if os.environ.get("WEDGEBRAKE_TRACEBACK"):
            raise
        _stop(
            f"internal error: {type(error).__name__}: {error}\nThis is a defect of wedgebrake."
            " Set WEDGEBRAKE_TRACEBACK=1 to see where, and please report it.",
            1,
        )


def _stop_at(error: OSError) -> None:
    """Exit after an error of the operating system, usually on writing to standard output."""
    if error.errno == errno.ENOENT and not _has_folder():
        _stop(
            "error: the working directory no longer exists. Change into one that exists, for"
            " example with cd.",
            2,
        )
    # Prevent a second attempt to flush standard output at exit.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    if error.errno == errno.EPIPE:  # the reader has closed the pipe, as in `| head`: no message
        _stop("", 1)
    if error.errno == errno.EBADF:
        _stop("error: standard output is closed. Open it, or redirect it to /dev/null.", 1)
    reason = (error.strerror or str(error)).lower()
    if error.filename is None:
        _stop(
            f"error: standard output cannot be written ({reason}). Free disk space, or redirect it"
            " to another file.",
            1,
        )
    _stop(f"error: {error.filename}: cannot be used ({reason}).", 1)


def _has_folder() -> bool:
    try:
        os.getcwd()  # noqa: PTH109 - only to see whether it exists
    except FileNotFoundError:
        return False
    return True


def _notes(error: BaseException) -> list[str]:
    return getattr(error, "__notes__", [])


def _stop(message: str, status: int) -> None:
    if message:
        say(message)
    sys.exit(status)
