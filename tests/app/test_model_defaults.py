"""Bokeh's models are the same whether their defaults are found once per class or for each model."""

import itertools
import json
import os
import re
import subprocess
import sys
from collections import defaultdict

# All models of Bokeh and Panel that can be made without arguments, and a page after a change of
# default lists in place: what is sent to a browser, all values, and the models they refer to.
_PROGRAM = """
import json, sys
import bokeh.models, panel as pn
from bokeh.document import Document
from bokeh.model import Model
from panel.io.state import set_curdoc
from wedgebrake.explorer.core.presets import preset
from wedgebrake.explorer.core.scheduler import Scheduler
from wedgebrake.explorer.core.snapshot import take_snapshot
from wedgebrake.explorer.ui.model_defaults import find_defaults_once
from wedgebrake.explorer.ui.session import Explorer

if sys.argv[1] == "once":
    find_defaults_once()

def described(cls):
    try:
        model = cls()
    except Exception as error:
        return type(error).__name__
    values = model.properties_with_values(include_undefined=True)
    document = Document()
    try:
        document.add_root(model)
        written = [document.to_json(), len(model.references())]
    except Exception as error:  # some values have no default
        written = type(error).__name__
    return [written, sorted(map(str, values)),
            sorted(type(one).__name__ for one in values.values())]

def page(state):
    document = Document()
    with set_curdoc(document):
        shown = Explorer(state, Scheduler(1))
        shown.__panel__().server_doc(document)
        shown._show_motion(state, 1, take_snapshot(state))
    figure = shown._charts[0].figure
    figure.tags.append("changed")
    figure.styles["color"] = "red"
    return document.to_json(), sorted(type(one).__name__ for one in document.models)

pn.extension("notifications")
found = {name: described(cls) for name, cls in sorted(Model.model_class_reverse_map.items())}
found["page"] = page(preset("start").state().edited(periods=20))
print(json.dumps(found, default=repr))
"""


def described(how):
    """What the program finds, with models numbered in the order in which they are named."""
    command = [sys.executable, "-c", _PROGRAM, how]
    # Sets in the same order in both.
    options = {"env": {**os.environ, "PYTHONHASHSEED": "0"}, "stdout": subprocess.PIPE}
    text = subprocess.run(command, check=True, **options).stdout
    found = {}
    for name, one in json.loads(re.sub(r" at 0x[0-9a-f]+", "", text.decode())).items():
        numbers = defaultdict(map(str, itertools.count()).__next__)
        found[name] = re.sub(r"\bp\d+\b", lambda named: numbers[named[0]], json.dumps(one))  # noqa: B023
    return found


def test_models_are_the_same():
    anew, once = described("anew"), described("once")
    assert anew.keys() == once.keys()
    assert len(anew) > 400
    assert sum("doc" in one or "roots" in one for one in anew.values()) > 300
    for name, one in anew.items():
        assert once[name] == one, name
