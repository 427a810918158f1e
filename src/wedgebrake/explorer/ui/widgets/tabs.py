"""Pictures over parameters in tabs: what they go over, their legend, how far they are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import panel as pn
import param
from panel.custom import JSComponent
from panel.viewable import Child

from wedgebrake.errors import InputError
from wedgebrake.explorer.core import basins, diagram, regimes, stability
from wedgebrake.explorer.core.axis import parameter_axis
from wedgebrake.explorer.core.state import PLATES, Desk, axes
from wedgebrake.explorer.ui.widgets.events import OnEvent, passing
from wedgebrake.explorer.ui.widgets.packing import packed
from wedgebrake.explorer.ui.widgets.sheets import sheets
from wedgebrake.model.groups import SETTERS

_HERE = Path(__file__).parent

_TABS = {
    "diagram": ("Bifurcation diagram", "Poincaré points over one parameter"),
    "regimes": ("Regimes", "Class of motion over two parameters"),
    "stability": ("Stability", "Linear stability of sliding over force slope and wedge angle"),
    "basins": ("Basins", "To which motion the machine settles, from where it starts"),
}  # fmt: skip
_ROLES = ("across", "up")


_SHEETS = sheets("theme.css", "atlas.css")


class AtlasHead(JSComponent):
    """Tabs, and what the open picture goes over."""

    state = param.String(default="{}", doc="tabs, tab, controls, quantity, as JSON")

    _esm = _HERE / "atlas_head.js"
    _stylesheets: ClassVar[list[str]] = _SHEETS


class AtlasFoot(JSComponent):
    """The legend, and how much of the picture is known."""

    state = param.Dict(default={}, doc="chips: (CSS background, words); progress; note")

    _esm = _HERE / "atlas_foot.js"
    _stylesheets: ClassVar[list[str]] = _SHEETS


class Atlas(JSComponent):
    """Tabs with the pictures; only the open one is seen.

    on_event : called with {type: "edit", changes}, of plate, axis, across, up, quantity, spans

    What changes often is in the head and the foot: Panel looks through all models below a part
    whenever one of its own parameters is set, which takes long where these are figures.
    """

    head = Child()
    diagram = Child()
    regimes = Child()
    stability = Child()
    basins = Child()
    foot = Child()
    tab = param.String(default="diagram", doc="the plate that is open")

    _esm = _HERE / "atlas.js"
    _stylesheets: ClassVar[list[str]] = _SHEETS

    def __init__(self, on_event: OnEvent, **params: Any) -> None:
        self._head = AtlasHead(sizing_mode="stretch_width", margin=0)
        self._foot = AtlasFoot(sizing_mode="stretch_width", margin=0)
        self._frames = {name: pn.Column(sizing_mode="stretch_both", margin=0) for name in PLATES}
        standing = {"sizing_mode": "stretch_both", "css_classes": ["atlas-whole"]}
        parts = {"head": self._head, "foot": self._foot, **self._frames}
        super().__init__(**{**standing, **parts, **params})
        self._head.on_msg(passing(on_event, ("edit",)))

    def hang(self, name: str, figure: Any) -> None:
        """Add the Bokeh figure of a plate to its empty frame."""
        pane = pn.pane.Bokeh(figure, sizing_mode="stretch_both", margin=0)
        self._frames[name].append(pane)

    def show(self, desk: Desk) -> None:
        """Show which picture is open and what it goes over."""
        plate = desk.view.plate
        head = {
            "tabs": [[name, *words] for name, words in _TABS.items()],
            "tab": plate,
            "controls": _controls(desk),
            "quantity": desk.view.quantity if plate == "diagram" else None,
        }
        self._head.state = packed(head)
        foot: dict[str, Any] = {"note": _note(desk)}
        if plate != self.tab:
            foot |= {"chips": [], "progress": ""}
        self._foot.state = {**self._foot.state, **foot}
        self.tab = plate

    def legend(self, chips: Sequence[tuple[str, str]]) -> None:
        """Show what colours mean, as (CSS background, words)."""
        self._foot.state = {**self._foot.state, "chips": [list(one) for one in chips]}

    def progress(self, text: str) -> None:
        """Say how much of the picture is known; nothing when it is whole."""
        self._foot.state = {**self._foot.state, "progress": text}


def _note(desk: Desk) -> str:
    """How the open picture is computed."""
    notes = {
        "diagram": "Each value is simulated from the same start until its motion has settled, or up"
        f" to a limit, beyond which it is undecided; {desk.recorded} further periods are shown.",
        "regimes": "Each cell is simulated from the same start until its motion has settled, or up"
        " to a limit, beyond which it is undecided.",
        "stability": "Small vibration about sliding, with the kinetic friction coefficient.",
        "basins": "Each start is simulated until its motion has settled, or up to a limit, beyond"
        " which it is undecided.",
    }
    return notes[desk.view.plate]


def _controls(desk: Desk) -> list[dict[str, Any]]:
    """For each parameter of the open picture {role, name, choices, label, symbol, low, high}.

    None where the machine has no such picture; its plate says why.
    """
    plate = desk.view.plate
    if plate == "diagram":
        return [_control(desk, "axis", diagram.parameter(desk), choices=True)]
    names = {"regimes": regimes.parameters, "stability": stability.parameters}
    pair = names[plate](desk) if plate in names else basins.parameters(desk)
    try:
        return [
            _control(desk, role, name, choices=plate == "regimes")
            for role, name in zip(_ROLES, pair, strict=True)
        ]
    except InputError:
        return []


def _control(desk: Desk, role: str, name: str, *, choices: bool) -> dict[str, Any]:
    axis = parameter_axis(desk, name)
    return {
        "role": role,
        "name": name,
        "choices": _choices(desk) if choices else [],
        "label": axis.words,
        "symbol": axis.symbol,
        "unit": "" if axis.unit == "1" else axis.unit.replace("^2", "²"),
        "low": axis.low,
        "high": axis.high,
    }


def _choices(desk: Desk) -> list[list[str]]:
    """(name, words, heading) of every parameter that a picture can go over."""
    names = sorted(axes(desk.system), key=lambda name: name not in SETTERS)
    found = []
    for name in names:
        axis = parameter_axis(desk, name)
        words = f"{axis.symbol}  {axis.words}".strip()
        found.append([name, words, "Groups" if name in SETTERS else "Parameters"])
    return found
