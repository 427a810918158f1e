"""The verdict above the plots: a headline and its tiles."""

from __future__ import annotations

from html import escape
from typing import Any

import panel as pn

from wedgebrake.explorer.ui.widgets.controls import style_sheet, update

_WORDS = {"good": "good", "warn": "caution", "bad": "critical", "neutral": ""}
_SIGNS = {"good": "✓", "warn": "!", "bad": "✕", "neutral": "·"}

_STARTING = "Computing …"


class VerdictStrip:
    """The verdict in words and colour."""

    def __init__(self) -> None:
        self.view = pn.pane.HTML(
            css_classes=["strip"], stylesheets=[style_sheet("verdict.css")], margin=0,
            sizing_mode="stretch_width",
        )  # fmt: skip
        self._verdict: dict[str, Any] = {"headline": _STARTING, "tone": "neutral", "tiles": []}
        self._number = 0

    @property
    def number(self) -> int:
        """The number of the study that is shown, 0 before the first."""
        return self._number

    def starting(self, words: str) -> None:
        """Show what is done before the first verdict."""
        self._verdict = {**self._verdict, "headline": f"{words} …"}
        self._put(pending=False)

    def show(self, verdict: dict[str, Any], number: int) -> None:
        """Show a verdict of ``verdict.verdict``, for the study with this number."""
        self._verdict, self._number = verdict, number
        self._put(pending=False)

    def pending(self) -> None:
        """Show that the next verdict is being computed; the last one stays."""
        self._put(pending=True)

    def _put(self, *, pending: bool) -> None:
        verdict = self._verdict
        tiles = "".join(map(_tile, verdict["tiles"]))
        update(self.view, object=(
            f'<div class="verdict {verdict["tone"]} {"pending" if pending else ""}"'
            f' data-motion="{self._number}"><p role="status" aria-live="polite">'
            f'<span class="headline">{escape(verdict["headline"])}</span>'
            f'<span class="tone">{_WORDS[verdict["tone"]]}</span></p><dl>{tiles}</dl></div>'
        ))  # fmt: skip


def _tile(tile: dict[str, str]) -> str:
    shown = {name: escape(text) for name, text in tile.items()}
    return (
        f'<div class="tile {shown["tone"]} tile-{shown["name"]}" title="{shown["hint"]}">'
        f'<dt>{shown["title"]}</dt><dd class="value"><i aria-hidden="true">'
        f"{_SIGNS[tile['tone']]}</i> {shown['value']}</dd><dd>{shown['detail']}</dd></div>"
    )
