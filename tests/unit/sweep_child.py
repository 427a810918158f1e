"""A process that runs a real sweep to be killed; it forks for each run, its kernels loaded.

It reads a path, answers with the pid of the run, reads an empty line, waits for the end of
the run and answers with "end" and its exit code.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import numpy as np

import wedgebrake as wb


def run(path: str | Path, points: int = 400) -> None:
    """The sweep: in chunks of 25 points, or goes on with it."""
    wb.sweep(
        wb.paper.system(),
        eta=np.linspace(-60.0, 12.0, points),
        store=path,
        resume=True,
        progress=False,
    )


def say(*words: object) -> None:
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def main() -> None:
    run(sys.argv[1], 4)
    say("ready")
    while path := sys.stdin.readline().rstrip("\n"):
        pid = os.fork()
        if pid == 0:
            signal.alarm(60)
            try:
                run(path)
                os._exit(0)
            except BaseException as error:
                sys.stderr.write(f"{error!r}\n")
                sys.stderr.flush()
                os._exit(1)
        say(pid)
        sys.stdin.readline()
        say("end", os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))


if __name__ == "__main__":
    main()
