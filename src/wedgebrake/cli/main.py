"""The program: commands, exit codes, and errors without tracebacks.

Exit status: 0 done, 2 the input is wrong, 1 anything else.
"""

from __future__ import annotations

import os
import sys

from wedgebrake.errors import InputError, OutputError


def main() -> None:
    """Run the command line and exit."""
    from wedgebrake.cli.commands import app

    try:
        app(standalone_mode=True)
    except (InputError, OutputError) as error:
        _stop(f"error: {error}", 2)
    except BrokenPipeError:
        # The reader of our output has gone, as in `| head`: nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except Exception as error:
        if os.environ.get("WEDGEBRAKE_TRACEBACK"):
            raise
        _stop(
            f"internal error: {type(error).__name__}: {error}\nThis is a defect of wedgebrake."
            " Set WEDGEBRAKE_TRACEBACK=1 to see where, and please report it.",
            1,
        )


def _stop(message: str, status: int) -> None:
    sys.stderr.write(message + "\n")
    sys.exit(status)
