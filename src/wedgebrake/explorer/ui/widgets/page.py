"""Layout of the page."""

from __future__ import annotations

from typing import Any

import panel as pn

from wedgebrake.explorer.ui.widgets.controls import style_sheet


def page(header: Any, parameters: Any, strip: Any, plots: Any, **cards: Any) -> pn.Column:
    """Return the page: a header, the parameters on the left, verdict and plots on the right.

    cards : history, phase, brake, spectrum and section
    """
    style = {"stylesheets": [style_sheet("page.css")], "margin": 0}
    strip.css_classes = ["strip"]
    framed = []
    for name, content in {**cards, "plots": plots}.items():
        content.css_classes = [*content.css_classes, "card", name]
        framed.append(content)
    main = pn.Column(strip, *framed, css_classes=["main"], sizing_mode="stretch_both", **style)
    return pn.Column(
        header, parameters, main, css_classes=["explorer"], sizing_mode="stretch_both", **style
    )
