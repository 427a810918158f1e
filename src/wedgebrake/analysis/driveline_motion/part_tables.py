"""Tables of the parts of many machines, from which a batch chooses."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wedgebrake.dynamics.records import record as fields

_FLOATS = NDArray[np.float64]
DRIVELINE = fields("inertia damping stiffness drive_speed")
BRAKE = fields("radius shape0 shape1 shape2 shape3")
ACTUATION = fields("initial_force slope release")
EXCITATION = fields("amplitude angular_frequency")
# Rows of the tables that make up a machine.
CHOICE = fields(whole="driveline brake friction actuation excitation")


class Tables(NamedTuple):
    """Parts of machines, one per row; a row that begins with nan is not a valid part.

    driveline, brake, actuation, excitation : of the dtypes above
    breakaway       : (n,) static coefficients of friction
    speeds, kinetic : (n, m) sliding speeds [m/s], and the coefficients there
    """

    driveline: Any
    brake: Any
    breakaway: _FLOATS
    speeds: _FLOATS
    kinetic: _FLOATS
    actuation: Any
    excitation: Any


def tables_of(rows: Mapping[str, Sequence[tuple[Any, ...] | None]]) -> Tables:
    """Tables from the numbers of each part: its fields, or None for an invalid part.

    Of friction: breakaway, speeds and coefficients, with equal numbers of points per row; shorter
    rows end at infinite speeds.
    """

    def table(part: str, dtype: np.dtype) -> Any:
        invalid = (math.nan,) * len(dtype.names or ())
        return np.array([invalid if row is None else row for row in rows[part]], dtype=dtype)

    friction = [(math.nan, (), ()) if row is None else row for row in rows["friction"]]
    most = max(len(speeds) for _, speeds, _ in friction)
    speeds, kinetic = np.full((len(friction), most), math.inf), np.zeros((len(friction), most))
    for i, (_, some, coefficients) in enumerate(friction):
        speeds[i, : len(some)], kinetic[i, : len(some)] = some, coefficients
    return Tables(
        table("driveline", DRIVELINE), table("brake", BRAKE),
        np.array([row[0] for row in friction]), speeds, kinetic,
        table("actuation", ACTUATION), table("excitation", EXCITATION),
    )  # fmt: skip
