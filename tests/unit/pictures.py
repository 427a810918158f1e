"""Synthetic datasets for pictures, and what can be measured on a figure."""

from __future__ import annotations

import itertools
import json

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from PIL import Image

import wedgebrake as wb
from wedgebrake.dynamics.enums import MotionClass, StickClass
from wedgebrake.model.view import DRIVELINE
from wedgebrake.sweeps.results import PointStatus, variables

SYSTEM = wb.paper.system()
COORDINATES = {
    "eta": ("1", "slope of the actuation force, delta R mu_k / c"),
    "F0": ("1", "initial actuation force"),
    "alpha": ("1", "tan(wedge angle) / mu_k"),
    "slope": ("N s/rad", "slope of the actuation force against speed"),
    "initial_angle": ("rad", "angle at the start"),
    "initial_velocity": ("rad/s", "velocity at the start"),
}


def sweep(kind="sweep", *, periods=None, follow=None, **axes):
    """A dataset in the format of sweeps: completed, synchronous, without numbers."""
    branches = ["up", "down"] if follow else []
    shape = tuple(len(one) for one in ([branches] if follow else []) + list(axes.values()))
    dims = (("branch",) if follow else ()) + tuple(axes)
    coordinates = {
        name: (name, np.asarray(values, dtype=float),
               dict(zip(("units", "long_name"), COORDINATES[name], strict=True)))
        for name, values in axes.items()
    }  # fmt: skip
    if follow:
        coordinates["branch"] = ("branch", branches)
    if periods:
        coordinates["period"] = ("period", np.arange(200, 200 + periods))
    data = {}
    for name, one in ((one.name, one) for one in variables(DRIVELINE)):
        if one.over and not periods:
            continue
        size = (*shape, periods) if one.over else shape
        names = (*dims, "period") if one.over else dims
        data[name] = (names, np.full(size, one.fill, dtype=one.dtype), one.attributes())
    dataset = xr.Dataset(data, coords=coordinates)
    for name, value in {
        "status": PointStatus.COMPLETED,
        "motion": MotionClass.SYNCHRONOUS,
        "order": 1,
        "stick_class": StickClass.UNIDIRECTIONAL,
        "sliding_damping": 1.0,
    }.items():
        dataset[name][...] = value
    protocol = {"periods": 250, "transient": 200, "initial": [0.0, 0.0], "follow": follow}
    dataset.attrs = {
        "kind": kind,
        "method": "exact",
        "system": json.dumps(SYSTEM.as_dict()),
        "groups": json.dumps(SYSTEM.groups.as_dict()),
        "protocol": json.dumps(protocol),
        "axes": json.dumps(list(axes)),
    }
    return dataset


def fill(dataset, name, values, *, order=None, **at):
    """Set a variable at some places, and the order with it."""
    dataset[name][at] = values
    if order is not None:
        dataset["order"][at] = order
    return dataset


def diagram(number=60, periods=20, values=None, **more):
    """A period doubling at the middle, chaos in the last quarter."""
    values = np.linspace(-60.0, 12.0, number) if values is None else values
    dataset = sweep("bifurcation", eta=values, periods=periods, **more)
    share = np.linspace(0.0, 1.0, len(values))
    sign = np.where(np.arange(periods) % 2, 1.0, -1.0)
    width = np.sqrt(np.clip(share - 0.5, 0.0, None))
    points = 3.0 + width[:, None] * sign
    chaos = share > 0.75
    rng = np.random.default_rng(1)
    points[chaos] = rng.uniform(1.0, 5.0, (np.count_nonzero(chaos), periods))
    dataset["velocity"][...] = points
    dataset["angle"][...] = 0.01 * points
    doubled = (share > 0.5) & ~chaos
    fill(dataset, "motion", MotionClass.PERIODIC, order=2, eta=doubled)
    fill(dataset, "motion", MotionClass.CHAOTIC, order=0, eta=chaos)
    dataset["sliding_damping"][...] = values + 10.0
    return dataset


def with_failures(dataset):
    """Runs that ended in every other way, five points each."""
    ends = (
        (PointStatus.DIVERGED, MotionClass.DIVERGED),
        (PointStatus.NO_FORWARD_SOLUTION, MotionClass.SELF_LOCKED),
        (PointStatus.EVENT_LIMIT, MotionClass.NONE),
        (PointStatus.INVALID, MotionClass.NONE),
        (PointStatus.NOT_COMPUTED, MotionClass.NONE),
        (PointStatus.COMPLETED, MotionClass.UNDECIDED),
    )
    for place, (status, motion) in enumerate(ends):
        at = {"eta": slice(5 * place, 5 * place + 5)}
        fill(dataset, "status", status, **at)
        fill(dataset, "motion", motion, order=0, **at)
        dataset["stick_class"][at] = StickClass.NONE
        if motion != MotionClass.UNDECIDED:
            dataset["velocity"][at] = np.nan
    dataset["velocity"][{"eta": slice(0, 5), "period": 0}] = 1e6
    return dataset


def map_of(x=30, y=20, **axes):
    """Chaotic to the right of the middle, 2T below it in the left half."""
    axes = axes or {"eta": np.linspace(-60.0, 12.0, x), "F0": np.linspace(0.01, 0.09, y)}
    dataset = sweep("regime_map", **axes)
    (first, xs), (second, ys) = ((name, np.asarray(values)) for name, values in axes.items())
    low, right = np.arange(ys.size) < ys.size // 2, np.arange(xs.size) >= xs.size // 2
    fill(dataset, "motion", MotionClass.PERIODIC, order=2, **{second: low})
    fill(dataset, "motion", MotionClass.CHAOTIC, order=0, **{first: right})
    dataset["peak_torque"][...] = 10.0 + xs[:, None] + 0.0 * ys
    dataset["friction_power"][...] = 1.0 + 0.0 * xs[:, None] + ys
    dataset["stick_share"][...] = 0.25
    dataset["largest_exponent"][...] = np.linspace(-1.0, 3.0, xs.size)[:, None] + 0.0 * ys
    dataset["sliding_damping"][...] = (xs - xs[0] - 0.3 * np.ptp(xs))[:, None] + 0.0 * ys
    return dataset


def basins_of(count, size=40):
    """As many attractors, in stripes of falling width; 2T, one point outside the window."""
    angles, velocities = np.linspace(-0.4, 0.4, size), np.linspace(-30.0, 30.0, size - 5)
    dataset = sweep("basins", initial_angle=angles, initial_velocity=velocities)
    weight = np.arange(2 * count, count, -1)
    edges = np.round(np.cumsum(weight) / weight.sum() * size).astype(int)
    # Numbered backwards, so that the ranking has something to do.
    number = count - 1 - np.searchsorted(edges, np.arange(size), side="right")
    stripes = np.repeat(number[:, None], size - 5, axis=1).astype(np.int32)
    where = ("initial_angle", "initial_velocity")
    dataset["attractor"] = where, stripes
    shares = np.array([np.mean(stripes == place) for place in range(count)])
    dataset["attractor_kind"] = "attractor_id", np.full(count, MotionClass.PERIODIC, np.int8)
    dataset["attractor_order"] = "attractor_id", np.full(count, 2, np.int32)
    dataset["attractor_share"] = "attractor_id", shares
    middle = [angles[number == place].mean() if shares[place] else 9.0 for place in range(count)]
    orbit = ("attractor_id", "orbit_point")
    dataset["attractor_angle"] = orbit, np.array([[a, a, np.nan] for a in middle])
    dataset["attractor_velocity"] = orbit, np.tile([5.0, 99.0, np.nan], (count, 1))
    return dataset


def words(figure):
    """Texts of all legends, row by row."""
    found = []
    for legend in (axes.get_legend() for axes in figure.axes):
        if legend:
            texts = [text.get_text() for text in legend.get_texts()]
            columns = np.array_split(texts, legend._ncols)
            rows = itertools.zip_longest(*columns)
            found += [str(word) for row in rows for word in row if word is not None]
    return found


def png(path):
    """Width and height of a PNG, all of whose pixels can be read."""
    with Image.open(path) as image:
        assert image.format == "PNG"
        image.load()
        return image.size


def data_axes(figure):
    return [axes for axes in figure.axes if axes.axison]


class Pixels:
    """Colours of a figure as it is drawn."""

    def __init__(self, figure, dpi=200):
        figure.set_dpi(dpi)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        self.image = np.asarray(canvas.buffer_rgba())[..., :3] / 255.0

    def at(self, axes, x, y):
        across, up = axes.transData.transform((x, y))
        return tuple(self.image[self.image.shape[0] - 1 - int(up), int(across)])

    def around(self, axes, x, y, half=15):
        across, up = (int(v) for v in axes.transData.transform((x, y)))
        row = self.image.shape[0] - 1 - up
        return self.image[row - half : row + half, across - half : across + half].reshape(-1, 3)


def close(one, other):
    return np.max(np.abs(np.subtract(one, to_rgb(other)))) < 0.01


def check_layout(figure):
    """Caption, panels, legends and labels of ticks are apart, and all is on the page."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    page = figure.bbox
    panels = [axes.get_window_extent(renderer) for axes in data_axes(figure)]
    lowest = min(axes.get_tightbbox(renderer).y0 for axes in data_axes(figure))
    title = figure._suptitle.get_window_extent(renderer)
    assert title.x1 <= page.x1
    assert title.y0 >= max(panel.y1 for panel in panels)
    assert title.y1 <= page.y1
    legends = [a.get_legend().get_window_extent(renderer) for a in figure.axes if a.get_legend()]
    assert legends
    for box in legends:
        assert box.y1 <= lowest + 1.0
        assert box.y0 >= page.y0
        assert box.x1 <= page.x1
    for upper, lower in itertools.pairwise(sorted(legends, key=lambda box: -box.y0)):
        assert lower.y1 <= upper.y0
    for axes in data_axes(figure):
        box = axes.get_tightbbox(renderer)
        assert page.x0 <= box.x0
        assert box.x1 <= page.x1 + 1.0
        inside = axes.get_window_extent(renderer).padded(1.0)
        for axis in (axes.xaxis, axes.yaxis):
            boxes = [
                label.get_window_extent(renderer)
                for label in axis.get_ticklabels()
                if label.get_visible() and label.get_text()
            ]
            middle = [0.5 * (box.min + box.max) for box in boxes]
            along = 0 if axis is axes.xaxis else 1
            boxes = [
                box
                for box, place in zip(boxes, middle, strict=True)
                if inside.min[along] <= place[along] <= inside.max[along]
            ]
            for one, other in itertools.combinations(boxes, 2):
                assert not one.overlaps(other)


# Linear RGB of what people with the three kinds of dichromacy see: Machado, Oliveira and
# Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009), 1291-1298, table 1, severity 1.0.
SIGHTS = {
    "trichromacy": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868],
         [0.114503, 0.786281, 0.099216],
         [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968],
         [0.280085, 0.672501, 0.047413],
         [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779],
         [-0.078411, 0.930809, 0.147602],
         [0.004733, 0.691367, 0.303900]]
    ),
}  # fmt: skip
# CIE 1931 XYZ of linear sRGB, and the white of D65 (IEC 61966-2-1).
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375],
     [0.2126729, 0.7151522, 0.0721750],
     [0.0193339, 0.1191920, 0.9503041]]
)  # fmt: skip
WHITE = XYZ @ np.ones(3)


def linear(colour):
    rgb = np.asarray(to_rgb(colour))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def luminance(colour):
    return float(XYZ[1] @ linear(colour))


def lab(colour, sight):
    """CIE L*a*b* of a colour as it is seen."""
    seen = XYZ @ np.clip(SIGHTS[sight] @ linear(colour), 0.0, 1.0) / WHITE
    f = np.where(seen > 216 / 24389, np.cbrt(seen), (24389 / 27 * seen + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def words_on_page(figure):
    """Every text that is seen in a drawn figure, with its box [pixel]."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    unseen = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            ticks = {*axis.get_major_ticks(), *axis.get_minor_ticks()}
            # Labels of ticks outside the limits are kept by Matplotlib, but not drawn.
            hidden = ticks - set(axis._update_ticks()) if axes.axison else ticks
            unseen |= {label for tick in hidden for label in (tick.label1, tick.label2)}
    return [
        (text.get_text(), Text.get_window_extent(text, renderer))
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and text not in unseen
    ]


def check_words(figure):
    """No two texts of a figure intersect, and none leaves the page."""
    found = words_on_page(figure)
    assert found
    for (one, box), (other, beside) in itertools.combinations(found, 2):
        assert not box.padded(-0.5).overlaps(beside.padded(-0.5)), (one, other)
    page = figure.bbox.padded(1.0)
    for one, box in found:
        assert page.x0 <= box.x0 <= box.x1 <= page.x1, one
        assert page.y0 <= box.y0 <= box.y1 <= page.y1, one
