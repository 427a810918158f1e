"""The program: commands, exit codes, and errors without tracebacks.

Exit status: 0 done, 2 the input is wrong, 1 anything else.
"""

from __future__ import annotations

import errno
import gc
import io
import os
import sys

from wedgebrake.cli.waiting import Interrupted, hearing_interrupts
from wedgebrake.errors import InputError, OutputError

USUAL_COLLECTIONS = gc.get_threshold()
"""How often Python collects garbage of itself."""


def main() -> None:
    """Run the command line and exit."""
    _spell_any_name()
    # Libraries make objects by the hundred thousand as they load, which stay: a collection
    # after every 700 finds nothing and costs a quarter of a second.
    gc.set_threshold(50_000, 10, 10)
    try:
        with hearing_interrupts():
            from wedgebrake.cli.commands import app

            app(prog_name="wedgebrake")
    except InputError as error:
        _stop(f"error: {error}", 2)
    except OutputError as error:
        _stop(f"error: {error}", 1)
    except (Interrupted, KeyboardInterrupt) as error:
        # At once: the computation still goes on in its thread, and Python must not be taken
        # apart under it.
        _say("\n".join(["interrupted", *_notes(error)]))
        os._exit(1)
    except MemoryError as error:
        way_out = (
            "Lower duration, periods or samples_per_period, for example with --set periods=100."
        )
        _stop(f"error: not enough memory. {' '.join(_notes(error)) or way_out}", 1)
    except OSError as error:
        # Standard output fails; it must not be tried again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        # EPIPE: the reader has gone, as in `| head`, and nothing is left to say.
        _stop("" if error.errno == errno.EPIPE else f"error: {error}", 1)
    except Exception as error:
        if "no locator available" in str(error):  # in Numba's words, as it loads
            _stop(
                "error: compiled kernels cannot be kept anywhere. Set NUMBA_CACHE_DIR to a folder"
                " that can be written; wedgebrake doctor says more.",
                1,
            )
        if os.environ.get("WEDGEBRAKE_TRACEBACK"):
            raise
        _stop(
            f"internal error: {type(error).__name__}: {error}\nThis is a defect of wedgebrake."
            " Set WEDGEBRAKE_TRACEBACK=1 to see where, and please report it.",
            1,
        )


def _spell_any_name() -> None:
    """Let names that the terminal's encoding lacks be written with escapes, not refused."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _notes(error: BaseException) -> list[str]:
    """What a command added to an error."""
    return getattr(error, "__notes__", [])


def _stop(message: str, status: int) -> None:
    if message:
        _say(message)
    sys.exit(status)


def _say(message: str) -> None:
    if sys.stderr is not None:
        sys.stderr.write(message + "\n")
        sys.stderr.flush()
