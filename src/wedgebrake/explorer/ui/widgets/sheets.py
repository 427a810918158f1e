"""Style sheets of the parts, embedded in the page so that no route has to serve them."""

from __future__ import annotations

from pathlib import Path


def sheets(*names: str) -> list[str]:
    """Content of the named style sheets in this folder."""
    return [Path(__file__).with_name(name).read_text(encoding="utf-8") for name in names]
