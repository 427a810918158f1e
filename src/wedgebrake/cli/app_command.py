"""The command ``app``: the explorer, served until Ctrl-C."""

from __future__ import annotations

import re
import webbrowser
from pathlib import Path

from wedgebrake.cli import garbage
from wedgebrake.cli.overrides import in_options
from wedgebrake.cli.streams import say
from wedgebrake.errors import InputError
from wedgebrake.model.studies.study import load_study
from wedgebrake.model.validation import check_installed, shown

_LOCAL = ("127.0.0.1", "localhost", "::1")
_ORIGIN = re.compile(r"[A-Za-z0-9.*-]+(:\d{1,5})?|\[[0-9a-fA-F:]+\](:\d{1,5})?")


def explore(
    path: Path | None, port: int, address: str, allowed: tuple[str, ...], browser: bool
) -> None:
    """Serve the explorer, print its address, and open it in a browser if wanted."""
    check_installed("app", ("panel", "bokeh"), "app")
    if not 0 <= port <= 65535:
        raise InputError(f"--port {port}: must be 0 to 65535; 0 selects a free port.")
    for one in allowed:
        if not _ORIGIN.fullmatch(one):
            raise InputError(
                f"--allow {shown(one)}: must be HOST or HOST:PORT, as in the browser's address"
                " line, for example lab.example.org:5006."
            )
    study = None if path is None else load_study(path)
    from wedgebrake.explorer.core.studies import opened
    from wedgebrake.explorer.ui.server import serve

    garbage.make_usual()

    def ready(url: str) -> None:
        say(f"The explorer is at {url} until Ctrl-C.")
        if address not in _LOCAL:
            say("Anyone who can reach this address can use this computer's processors.")
        if browser:
            webbrowser.open(url)

    try:
        serve(opened(study), address=address, port=port, origins=allowed, ready=ready)
    except InputError as error:
        raise in_options(error, ("port", "address")) from None
    say("stopped")
