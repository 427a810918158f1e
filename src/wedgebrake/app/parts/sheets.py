"""The styles of the parts, as text within the page: no route has to serve them."""

from __future__ import annotations

from pathlib import Path


def sheets(*names: str) -> list[str]:
    """The text of some style sheets that lie here."""
    return [Path(__file__).with_name(name).read_text(encoding="utf-8") for name in names]
