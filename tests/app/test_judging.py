"""A machine has one class, wherever the explorer says it."""

import re

import pytest

import wedgebrake as wb
from wedgebrake.dynamics.enums import motion_word
from wedgebrake.explorer.core.computation import following
from wedgebrake.explorer.core.export import export
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.program import picture
from wedgebrake.explorer.core.snapshot import take_snapshot

# Of each but the first the run as it is set is too short to tell, or tells something else.
MACHINES = [
    ("fig7a", {}), ("fig10b", {}), ("fig12d", {}), ("fig13d", {}), ("fig16b", {}), ("band", {}),
    ("fig18b", {}), ("leading-shoe", {}), ("start", {"eta": -28.0}), ("fig9c", {}),
    ("fig16e", {"friction": "smoothed"}), ("fig10c", {"friction": "smoothed", "periods": 60}),
    ("fig6b", {"friction": "smoothed", "method": "ode14x", "periods": 40}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "changes"), MACHINES)
def test_pictures_and_program_say_what_the_page_says(name, changes):
    state = preset(name).state()
    for one, value in changes.items():
        state = state.edited(**{one: value})
    word = take_snapshot(state, settle=True).motion.word
    for plot, function in (("diagram", wb.bifurcation), ("regimes", wb.regime_map)):
        call = picture(state.edited(plot=plot))
        assert call.function == function.__name__
        here = {name: [float(state.value(name))] for name in call.axes}
        point = function(following(state.system), **here, **call.options, progress=False).squeeze()
        assert motion_word(int(point["motion"]), int(point["order"])) == word, plot
    program = export(state, "python").content.decode()
    head = program.partition("response = ")[0]
    call = re.search(r"^motion = wb\.motion\((.*\)|\n(    .*\n)*\))$", program, re.MULTILINE)[0]
    names = {}
    exec(f"{head}\n{call}", names)  # noqa: S102 - our own text
    assert names["motion"].word == word
    if "method" not in changes:
        assert word in export(state, "svg").content.decode()
