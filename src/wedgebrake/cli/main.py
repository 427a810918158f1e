"""The program: commands, exit codes, and errors without tracebacks.

Exit status: 0 done, 2 the input is wrong, 1 anything else.
"""

from __future__ import annotations

import errno
import io
import os
import sys
import threading

from wedgebrake.errors import InputError, OutputError


def main() -> None:
    """Run the command line and exit."""
    from wedgebrake.cli.waiting import Interrupted

    _write_any_name()
    try:
        from wedgebrake.cli.commands import app

        app()
    except (InputError, OutputError) as error:
        _stop(f"error: {error}", 2)
    except (Interrupted, KeyboardInterrupt):
        _stop("interrupted", 1)
    except MemoryError:
        _stop(
            "error: not enough memory. Lower duration, periods or samples_per_period, for"
            " example with --set periods=100.",
            1,
        )
    except OSError as error:
        _stop(_about_standard_output(error), 1)
    except Exception as error:
        if os.environ.get("WEDGEBRAKE_TRACEBACK"):
            raise
        _stop(
            f"internal error: {type(error).__name__}: {error}\nThis is a defect of wedgebrake."
            " Set WEDGEBRAKE_TRACEBACK=1 to see where, and please report it.",
            1,
        )


def _write_any_name() -> None:
    """Let a name that standard output cannot spell be written with escapes, not refused."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _about_standard_output(error: OSError) -> str:
    """What to say when standard output fails; it is then left alone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    if error.errno == errno.EPIPE:
        return ""  # the reader has gone, as in `| head`: nothing is left to say
    return f"error: cannot write ({error.strerror or error}). Is the disk full?"


def _stop(message: str, status: int) -> None:
    if message and sys.stderr is not None:
        sys.stderr.write(message + "\n")
        sys.stderr.flush()
    if threading.active_count() > 1:
        # A computation goes on in its thread; to wait for it, or to take Python apart
        # under it, would be worse than to leave at once.
        os._exit(status)
    sys.exit(status)
