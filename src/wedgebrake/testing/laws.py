"""Checks of brakes and friction laws: signs, finite values, and the solvers against the law."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from wedgebrake.dynamics.brake_torque import SHAPE_SIZE
from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.brakes import Brake, ConventionalBrake, LeverBrake
from wedgebrake.model.characteristic import characteristic
from wedgebrake.model.friction import CoulombFriction, Friction, SetValuedFriction, SmoothFriction
from wedgebrake.model.machine import Machine
from wedgebrake.model.machine_parts import Contact, Inertia
from wedgebrake.model.validation import check_instance, is_number
from wedgebrake.solvers.simulate import simulate
from wedgebrake.solvers.smooth.laws import brake_law, friction_law
from wedgebrake.testing.parts import check_part, claim

_Law = Callable[[float], float]
_COEFFICIENTS = (1e-6, 1e-3, 0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 2.0, 5.0)
_SPEEDS = (0.0, *np.geomspace(1e-9, 1e6, 151).tolist())  # [m/s]
# Relative difference of a compiled law from Python that is rounding, also near self-locking.
_ROUNDING = 1e-9
# Of a jump: the narrowest relative interval, and the least height relative to the largest value.
_NARROW, _HIGH = 1e-9, 1e-3
_TOLERANCES = (1e-4, 1e-9)
# Speeds from which a disc is braked [m/s], and the largest relative difference of its speed from
# the solution by SciPy.
_STARTS, _SLOWED = (0.05, 1.0, 20.0), 1e-7
# Share of its friction at width that a smooth law may have at a thousandth of its width.
_INSIDE, _JUMP = 1e-3, 0.5


def check_brake(brake: Brake) -> None:
    """Check a brake: its values as a part, and the law g(m) of its amplification.

    - ``shape`` gives at most four finite numbers.
    - g(0) = 0, g has the sign of m, and is a number, or inf where the brake locks itself.
    - The compiled law gives the values of the Python function.
    - A ``LeverBrake`` has the law of its arms, as solvers use the arms alone.
    - The brake torque opposes sliding and is proportional to the actuation force.

    Raises ``AssertionError`` for a brake that does not, ``InputError`` for what is no brake.
    """
    check_instance("brake", brake, Brake, "a brake")
    check_part(brake)
    name, shape = type(brake).__name__, brake.shape()
    _check_shape(name, shape)
    values = {m: _evaluated(f"{name}.law", lambda m: type(brake).law(m, shape), m)
              for size in (0.0, *_COEFFICIENTS) for m in (size, -size)}  # fmt: skip
    for m, value in values.items():
        where = f"{name}.law({m!r}, shape) = {value!r}"
        claim(not math.isnan(value), f"{where}: must be a number, or inf where the brake locks.")
        signed = value * m > 0.0 or value == 0.0 or (m < 0.0 and value == math.inf)
        claim(signed and (m != 0.0 or value == 0.0), f"{where}: must have the sign of m, 0 at 0.")
        if isinstance(brake, LeverBrake):
            a, b, d = shape
            lever = m * a / (b - m * d) if m * d < b else math.inf
            claim(
                math.isclose(value, lever, rel_tol=_ROUNDING),
                f"{where}: a LeverBrake must have m a/(b - m d) = {lever!r} of its arms.",
            )
    _check_compiled(f"{name}.law", lambda: brake_law(brake), values)
    for mu in _COEFFICIENTS:
        if math.isfinite(values[mu]) and math.isfinite(values[-mu]):
            _check_torque(name, brake, mu, values)


def _check_torque(name: str, brake: Brake, mu: float, values: dict[float, float]) -> None:
    for force in (100.0, 200.0):
        law = characteristic(brake, CoulombFriction(kinetic=mu), Actuation(initial_force=force))
        for speed in (1.0, -1.0):
            torque = float(law.torque(speed))
            expected = brake.radius * force * values[math.copysign(mu, speed)]
            claim(
                math.isclose(torque, expected, rel_tol=_ROUNDING),
                f"{name}: the brake torque at {speed} rad/s, {force} N and mu = {mu} must be R F"
                f" g = {expected!r}, which opposes sliding, not {torque!r}.",
            )


def check_friction(friction: Friction) -> None:
    """Check a friction law: its values as a part, the law, and a motion that it brakes.

    Every law: ``reference`` is a finite number, at least 0; a law that is ``constant`` has one
    value at all speeds; a disc that it brakes slows down as SciPy says of the Python function, with
    each method that can solve the law.

    Set-valued laws: the kinetic coefficient is finite, at least 0 and continuous up to 10⁶ m/s;
    ``breakaway`` is at least the coefficient at rest; ``nodes`` begin at speed 0, ascend, and begin
    at the value of ``kinetic_at``; ``bends`` ascend above 0.

    Smooth laws: the coefficient is finite, has the sign of the speed, and rises from 0 over about
    the ``transition``; ``limit`` holds from ``saturation`` on; ``narrow_places`` are pairs of
    numbers above 0; the compiled law gives the values of the Python function.

    Raises ``AssertionError`` for a law that does not, ``InputError`` for what is no friction law.
    """
    check_instance("friction", friction, Friction, "a friction law")
    check_part(friction)
    name = type(friction).__name__
    _check_coefficient(f"{name}.reference", friction.reference)
    if isinstance(friction, SetValuedFriction):
        _check_set_valued(name, friction)
    elif isinstance(friction, SmoothFriction):
        _check_smooth(name, friction)
    else:
        raise AssertionError(f"{name}: must derive from SetValuedFriction or SmoothFriction.")


def _check_set_valued(name: str, law: SetValuedFriction) -> None:
    claim(
        law.has_nodes or law.is_curve, f"{name}: must define nodes(), kinetic_at(speed), or both."
    )
    values = [_evaluated(f"{name}.kinetic_at", law.kinetic_at, speed) for speed in _SPEEDS]
    for speed, value in zip(_SPEEDS, values, strict=True):
        _check_coefficient(f"{name}.kinetic_at({speed:g})", value)
    at_rest = values[0]
    claim(
        law.breakaway >= at_rest * (1.0 - _ROUNDING) and math.isfinite(law.breakaway),
        f"{name}.breakaway = {law.breakaway!r}: must be finite and at least kinetic_at(0.0) ="
        f" {at_rest!r}.",
    )
    _check_continuous(f"{name}.kinetic_at", law.kinetic_at, values)
    _check_ascending(f"{name}.bends", law.bends, 0.0)
    if law.constant:
        _check_constant(name, values, values)
    if law.has_nodes:
        nodes = law.nodes()
        _check_nodes(name, nodes, at_rest)
        speeds, coefficients = zip(*nodes, strict=True)
        _check_motion(name, law, lambda v: float(np.interp(v, speeds, coefficients)), "exact")
    _check_motion(name, law, law.kinetic_at, "smooth")


def _check_nodes(name: str, nodes: Sequence[tuple[float, float]], at_rest: float) -> None:
    claim(nodes and nodes[0][0] == 0.0, f"{name}.nodes(): must begin at speed 0, not {nodes[:1]}.")
    _check_ascending(f"{name}.nodes()", [speed for speed, _ in nodes[1:]], 0.0)
    for speed, value in nodes:
        _check_coefficient(f"{name}.nodes(), at the speed {speed!r}", value)
    claim(
        math.isclose(nodes[0][1], at_rest, rel_tol=_ROUNDING, abs_tol=_ROUNDING),
        f"{name}.nodes(): must begin with kinetic_at(0.0) = {at_rest!r}, not {nodes[0][1]!r}.",
    )


def _check_smooth(name: str, law: SmoothFriction) -> None:
    _check_shape(name, law.shape())
    speeds = [sign * one for one in _SPEEDS for sign in (1.0, -1.0)]
    values = {v: _evaluated(f"{name}.law", law.coefficient, v) for v in speeds}
    for speed, value in values.items():
        where = f"{name}.coefficient({speed:g}) = {value!r}"
        claim(math.isfinite(value), f"{where}: must be a finite number.")
        claim(value * speed >= 0.0, f"{where}: must have the sign of the speed.")
    width = law.transition
    claim(
        is_number(width) and 0.0 < width < math.inf,
        f"{name}.transition = {width!r}: must be a number above 0.",
    )
    for sign in (1.0, -1.0):
        at_width, inside = (abs(law.coefficient(sign * one * width)) for one in (1.0, _INSIDE))
        claim(
            inside <= _JUMP * at_width,
            f"{name}: the coefficient is {inside!r} at {_INSIDE:g} of the transition and"
            f" {at_width!r} at the transition: must rise from 0 over about the transition.",
        )
    for i, place in enumerate(law.narrow_places):
        claim(
            len(place) == 2 and all(0.0 < one < math.inf for one in place),
            f"{name}.narrow_places[{i}] = {place!r}: must be a speed and a half width above 0.",
        )
    if not math.isnan(law.limit):
        for tolerance in _TOLERANCES:
            end = law.saturation(tolerance)
            for speed in () if math.isinf(end) else (end, 2.0 * end, 10.0 * end):
                value = law.coefficient(speed)
                claim(
                    abs(value - law.limit) <= 2.0 * tolerance * law.limit,
                    f"{name}.coefficient({speed:g}) = {value!r}: must equal limit = {law.limit!r}"
                    f" to {tolerance:g}, as saturation({tolerance:g}) = {end!r}.",
                )
    if law.constant:
        beyond = [v for v in _SPEEDS if v >= law.layer(_ROUNDING)]
        _check_constant(name, [values[v] for v in beyond], [-values[-v] for v in beyond])
    near = 1e-6 * width  # within which a custom law is a straight line
    _check_compiled(
        f"{name}.law",
        lambda: friction_law(law),
        {v: value for v, value in values.items() if abs(v) >= near},
    )
    _check_motion(name, law, law.coefficient, "smooth")


def _check_shape(name: str, shape: Sequence[float]) -> None:
    claim(
        len(shape) <= SHAPE_SIZE and all(is_number(one) and math.isfinite(one) for one in shape),
        f"{name}.shape() = {shape!r}: must be at most {SHAPE_SIZE} finite numbers.",
    )


def _check_coefficient(where: str, value: Any) -> None:
    claim(
        is_number(value) and 0.0 <= value < math.inf,
        f"{where} = {value!r}: must be a finite number, at least 0.",
    )


def _check_ascending(where: str, values: Sequence[float], first: float) -> None:
    for before, after in pairwise((first, *values)):
        claim(
            before < after < math.inf,
            f"{where}: {after!r} follows {before!r}: speeds must ascend from {first:g} and be"
            " finite.",
        )


def _check_constant(name: str, *lists: Sequence[float]) -> None:
    for values in lists:
        claim(
            not values or max(values) - min(values) <= _ROUNDING * max(values),
            f"{name}.constant is True: must be False, as the coefficient varies with the speed.",
        )


def _evaluated(where: str, law: _Law, value: float) -> float:
    try:
        return float(law(value))
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise AssertionError(f"{where} at {value!r}: raises {error!r}.") from None


def _check_continuous(where: str, law: _Law, values: Sequence[float]) -> None:
    """Look for a jump between two neighbouring speeds whose values differ, by bisection."""
    least = _HIGH * max(values)
    for ends in pairwise(zip(_SPEEDS, values, strict=True)):
        (left, at_left), (right, at_right) = ends
        while abs(at_right - at_left) > least and right - left > _NARROW * right:
            middle = 0.5 * (left + right)
            value = law(middle)
            if abs(value - at_left) >= abs(at_right - value):
                right, at_right = middle, value
            else:
                left, at_left = middle, value
        claim(
            abs(at_right - at_left) <= least or left == 0.0,
            f"{where}: jumps from {at_left!r} to {at_right!r} at the speed {right!r}: must be"
            " continuous.",
        )


def _check_compiled(where: str, compiled: Callable[[], Any], values: dict[float, float]) -> None:
    try:
        law, shape = compiled()
    except InputError as error:
        raise AssertionError(f"{where}: must be a function that Numba compiles. {error}") from None
    for at, value in values.items():
        found = law(at, shape)
        claim(
            math.isclose(found, value, rel_tol=_ROUNDING, abs_tol=1e-300),
            f"{where} at {at!r}: compiled, it gives {found!r}, as a Python function {value!r}.",
        )


def _check_motion(name: str, law: Friction, coefficient: _Law, method: str) -> None:
    """Compare a disc that is braked to about half its speed with the solution by SciPy.

    Radius, inertia and force are 1, so that the deceleration is the coefficient.
    """
    contact = Contact(
        "disc", name="brake", brake=ConventionalBrake(radius=1.0), friction=law,
        actuation=Actuation(initial_force=1.0),
    )  # fmt: skip
    for start in _STARTS:
        strongest = max(coefficient(share * start) for share in (1.0, 0.9, 0.75, 0.5))
        if strongest <= 0.0:
            continue
        duration = 0.4 * start / strongest
        machine = Machine(inertias=[Inertia("disc", 1.0, speed=start)], contacts=[contact])
        try:
            found = simulate(machine, duration, method=method, times=[duration])
        except InputError as error:
            raise AssertionError(f"{name}: the method {method} refuses it. {error}") from None
        speed = float(found["velocity"].values[-1, 0])
        reference = solve_ivp(
            lambda _, v: [-coefficient(v[0])], (0.0, duration), [start], method="DOP853",
            rtol=1e-11, atol=1e-13 * start, max_step=duration / 50.0,
        ).y[0, -1]  # fmt: skip
        claim(
            abs(speed - reference) <= _SLOWED * start,
            f"{name}: from {start} rad/s a disc must slow down to {reference!r} rad/s within"
            f" {duration!r} s, but has {speed!r} rad/s by the method {method}. Give kinks of"
            " the law in bends, or narrow features in narrow_places.",
        )
