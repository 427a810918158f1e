"""The checks of ``wb.testing``: every class of the package passes, and wrong ones do not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import wedgebrake as wb
from wedgebrake.model.machine_parts import OverState
from wedgebrake.model.part import Part
from wedgebrake.model.signals.signals import Product, Sum
from wedgebrake.model.studies.records import FrictionRecord, TableSource
from wedgebrake.model.studies.study_run import RunSettings
from wedgebrake.model.studies.sweep_settings import Span, Sweep
from wedgebrake.testing import (
    check_brake,
    check_derivatives,
    check_friction,
    check_part,
    check_signal,
)

SINE = wb.Harmonic(500.0, 10.03, 0.3)
RAMP = wb.Ramp(10.0, 20.0, 2.0)
JUMPS = [0.0, 1.0, 1.0, 2.0], [0.0, 1.0, 3.0, 5.0]


def worn(speed: float) -> float:
    bump = 0.05 * math.exp(-(((abs(speed) - 0.5) / 0.02) ** 2))
    return (0.28 + bump) * math.tanh(speed / 0.005)


BRAKES = (
    wb.ConventionalBrake(radius=0.2),
    wb.WedgeBrake(radius=0.2, angle=0.34),
    wb.BandBrake(radius=0.2, wrap_angle=4.0),
    wb.LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.08),
    wb.LeadingShoeBrake(radius=0.2, actuation_arm=0.2, normal_arm=0.1, friction_arm=0.0),
)
LAWS = (
    wb.CoulombFriction(kinetic=0.3),
    wb.CoulombFriction(kinetic=0.0, static=0.4),
    wb.TabulatedFriction(speeds=[0.0], coefficients=[0.3]),
    wb.TabulatedFriction(
        speeds=[0.0, 0.1, 1.0], coefficients=[0.4, 0.35, 0.3], static=0.45, scale=1.1
    ),
    wb.StribeckFriction(kinetic=0.2, static=0.35, speed=0.1),
    wb.StribeckFriction(kinetic=0.2, static=0.35, speed=0.1, tolerance=0.5),
    wb.SmoothedFriction(kinetic=0.3, static=0.4),
    wb.SmoothedFriction(kinetic=0.3, static=0.5, decay=0.0, steepness=10.0),
    wb.SmoothedFriction(kinetic=0.3),
    wb.CustomFriction(law=worn, width=0.005, kinetic=0.28, narrow=[(0.5, 0.02)]),
)
SIGNALS = (
    wb.Constant(3.0),
    wb.Constant(0.0),
    SINE,
    wb.Harmonic(1.0, 1e-3),
    wb.Table(*JUMPS),
    wb.Table(*JUMPS, after="hold"),
    wb.Table(*JUMPS, after="zero"),
    wb.Table(*JUMPS, periodic=True),
    wb.Table([0.0, 0.0, 1.0, 1.0], [9.0, 1.0, 2.0, 7.0], after="hold"),
    wb.Table([3.0, 5.0], [1.0, 2.0]),
    wb.Table(range(30), np.sin(range(30)), after="zero"),
    RAMP,
    SINE + RAMP - 3.0,
    300.0 * (1.0 + 0.1 * SINE) * wb.Table(*JUMPS, after="hold"),
    SINE * wb.Harmonic(1.0, 9.0),
    wb.Orders(RAMP, [(2.0, 1.0, 0.0)]),
    wb.Ramp(10.0, 20.0, 2.0, law="log"),
    wb.Ramp(-2.0, -0.1, 1.0, 0.5, "log"),
    wb.Chirp(3.0, 2.0, 20.0, 1.5),
    wb.Chirp(3.0, 20.0, 2.0, 1.5, "log"),
    wb.HarmonicTorque(500.0, 10.03),
    wb.HarmonicTorque(0.0, 10.03),
    wb.HarmonicTorque(500.0, 10.0, orders=[(2.0, 0.5, 0.1), (0.5, 0.2, 0.0)]),
)
OTHERS = (
    wb.Driveline(inertia=1.0, damping=0.1, stiffness=1e4),
    wb.Driveline(inertia=1.0, damping=0.1, stiffness=1e4, drive_speed=80.0 + SINE),
    wb.Actuation(initial_force=300.0, slope=-40.0),
    wb.Actuation(initial_force=SINE, limits=(0.0, 1e3), sample_time=1e-3, delay=1, resolution=0.5),
    wb.Actuation(initial_force=300.0, frequency=200.0, damping_ratio=0.7),
    wb.Inertia("disc", 1.0, speed=10.0),
    wb.Driven("end", 80.0 + SINE),
    wb.OneWayClutch("disc", "motor", name="free", drag=2.0, capacity=50.0),
    wb.Drag("disc", 0.4, 0.02),
    wb.Gear("motor", "wheel", 3.5),
    wb.Rigid("motor", "wheel", name="hub"),
    wb.Planetary("sun", "ring", "carrier", 2.5),
    wb.Controller(
        "loop", {"motor.angle": 2.0, "brake.force": 0.01}, 1.0, "brake.command", 1.0, 2.0, 0.1,
        0.05, (-50.0, 80.0),
    ),
    wb.Controller(
        "loop", {"spring.torque": 0.1}, 1.0, "motor.torque", 1.0, 2.0, limits=(-5.0, 8.0),
        sample_time=0.01, delay=1,
    ),
    wb.Shaft("motor", "disc", 2e4, 1.0, ratio=-2.5),
    wb.Shaft("disc", "ground", 2e4),
    wb.Shaft("disc", "ground", 2e4, 1.0, rest=0.1, gap=(-0.1, 0.2)),
    wb.Shaft("disc", "ground", wb.Stages([-0.1, 0.1], [1e3, 0.0, 1e3])),
    wb.Stages([0.1], [1.0, 2.0]),
    wb.Torque("disc", SINE, name="engine"),
    wb.Torque("disc", wb.OverSpeed([0.0, 1.0], [2.0, 0.0]), relative_to="motor"),
    wb.OverSpeed([0.0, 1.0], [2.0, 0.0]),
    wb.OverAngle([0.0, 1.0], [2.0, 0.0], period=3.0),
    wb.Contact("disc", name="brake", brake=BRAKES[1], friction=LAWS[4], base_speed=80.0,
               actuation=wb.Actuation(initial_force=300.0)),
    wb.paper.system(),
    wb.paper.system().replace(excitation=RAMP),
    wb.paper.system().machine,
)  # fmt: skip
DISCS = (wb.LumpedDisc(8.0, 500.0), wb.SemiInfiniteDisc(50.0, 7200.0, 500.0, 0.04))
CHECKS = ((check_brake, BRAKES), (check_friction, LAWS), (check_signal, SIGNALS),
          (check_part, (*OTHERS, *DISCS, RunSettings(periods=20, initial=(0.01, 0.0)))),
          (check_derivatives, (*BRAKES, *LAWS, *SIGNALS, *OTHERS)),
)  # fmt: skip


@pytest.mark.parametrize(
    ("check", "part"),
    [pytest.param(check, one, id=f"{type(one).__name__}{i}")
     for check, parts in CHECKS for i, one in enumerate(parts)],
)  # fmt: skip
def test_the_parts_of_the_package_pass(check: Any, part: Part) -> None:
    check(part)


def test_no_class_of_the_package_is_forgotten() -> None:
    def derived(base: type[Part]) -> Iterator[type[Part]]:
        for one in base.__subclasses__():
            yield one
            yield from derived(one)

    # Bases, and tables of study files whose fields are no parameters of a system.
    others = {wb.Brake, wb.LeverBrake, wb.Signal, wb.SetValuedFriction, wb.SmoothFriction,
              OverState, TableSource, FrictionRecord, Sweep, Span}  # fmt: skip
    passed = {type(one) for _, parts in CHECKS for one in parts}
    public = {
        one for one in derived(Part)
        if one.__module__.startswith("wedgebrake.") and not one.__name__.startswith("_")
    }  # fmt: skip
    concrete = {one for one in public if one.__name__ not in ("Member", "Positional", "Chosen",
                "Named", "Joint", "TorqueContact", "Exponential", "Integral", "Friction",
                "System")}  # fmt: skip
    assert concrete - others - passed == set()
    assert {Sum, Product} <= passed


# Laws and signals with one fault each, at the top level so that they can be pickled.
GAIN = 1.0


class Brake(wb.Brake):
    gain: float = 2.0

    def shape(self) -> tuple[float, ...]:
        return (self.gain,)

    @staticmethod
    def law(m: float, shape: Any) -> float:
        return shape[0] * m


class UnlockedWedge(Brake):
    @staticmethod
    def law(m: float, shape: Any) -> float:  # noqa: ARG004
        return m / (0.4 - m)


class Poled(Brake):
    @staticmethod
    def law(m: float, shape: Any) -> float:
        return shape[0] * m / abs(0.5 - m)


class Undefined(Brake):
    @staticmethod
    def law(m: float, shape: Any) -> float:
        return shape[0] * m if abs(m) < 1.5 else math.nan


class NotCompiled(Brake):
    @staticmethod
    def law(m: float, shape: Any) -> float:
        return float(f"{shape[0] * m}")


class Frozen(Brake):
    @staticmethod
    def law(m: float, shape: Any) -> float:
        return GAIN * shape[0] * m


class Lever(wb.LeverBrake):
    def shape(self) -> tuple[float, float, float]:
        return (1.0, 1.0, 0.1)

    @staticmethod
    def law(m: float, shape: Any) -> float:  # noqa: ARG004
        return 2.0 * m


class Many(Brake):
    def shape(self) -> tuple[float, ...]:
        return (self.gain, 1.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("brake", "words"),
    [
        (UnlockedWedge, "must have the sign of m"),
        (Poled, r"at 0\.5: raises"),
        (Undefined, "inf where the brake locks"),
        (NotCompiled, "a function that Numba compiles"),
        (Lever, "LeverBrake must have m a/"),
        (Many, "at most 4 finite numbers"),
    ],
)
def test_wrong_brakes(brake: type[wb.Brake], words: str) -> None:
    with pytest.raises(AssertionError, match=rf"{brake.__name__}.*{words}"):
        check_brake(brake(radius=0.2))


def test_a_law_that_reads_a_variable_is_compiled_with_its_first_value(monkeypatch: Any) -> None:
    check_brake(Frozen(radius=0.2))
    monkeypatch.setattr(f"{__name__}.GAIN", 3.0)
    with pytest.raises(AssertionError, match="compiled, it gives"):
        check_brake(Frozen(radius=0.2))


class Smooth(wb.SmoothFriction):
    width: float = 0.01
    reference = 0.3

    @property
    def transition(self) -> float:
        return self.width

    def shape(self) -> tuple[float, ...]:
        return (self.width,)

    @staticmethod
    def law(speed: float, shape: Any) -> float:
        return 0.3 * math.tanh(speed / shape[0])


class PushingFast(Smooth):
    @staticmethod
    def law(speed: float, shape: Any) -> float:
        return 0.3 * math.tanh(speed / shape[0]) * (1.0 - abs(speed) / 300.0)


class Steep(Smooth):
    @staticmethod
    def law(speed: float, shape: Any) -> float:
        return 0.3 * math.tanh(1e4 * speed / shape[0])


class WrongLimit(Smooth):
    limit = 0.31

    def saturation(self, tolerance: float) -> float:
        return self.layer(tolerance)


class Varying(Smooth):
    constant = True

    @staticmethod
    def law(speed: float, shape: Any) -> float:
        return 0.3 * math.tanh(speed / shape[0]) * (1.0 + math.exp(-abs(speed)))


class Narrow(Smooth):
    narrow_places = ((0.5, -0.1),)


class SetValued(wb.SetValuedFriction):
    at_rest: float = 0.4
    kinetic: float = 0.3

    @property
    def breakaway(self) -> float:
        return self.at_rest

    def kinetic_at(self, speed: float) -> float:
        return self.kinetic + (self.at_rest - self.kinetic) * math.exp(-speed)


class Weak(SetValued):
    breakaway = 0.35


class Jumping(SetValued):
    def kinetic_at(self, speed: float) -> float:
        return 0.4 if speed < 0.5 else 0.3


class Negative(SetValued):
    def kinetic_at(self, speed: float) -> float:
        return 0.4 - 0.001 * speed


class OtherNodes(SetValued):
    def nodes(self) -> tuple[tuple[float, float], ...]:
        return ((0.0, 0.3), (1.0, 0.3))


class Unsorted(SetValued):
    def nodes(self) -> tuple[tuple[float, float], ...]:
        return ((0.0, 0.4), (2.0, 0.3), (1.0, 0.3))


class Constant(SetValued):
    constant = True


class Empty(wb.SetValuedFriction):
    reference = 0.3
    breakaway = 0.3


class Noisy(SetValued):
    def kinetic_at(self, speed: float) -> float:
        return round(0.3 + 0.1 * math.exp(-speed), 4)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (PushingFast, "must have the sign of the speed"),
        (Steep, "rise from 0 over about the transition"),
        (WrongLimit, "must equal limit"),
        (Varying, "constant is True"),
        (Narrow, "a half width above 0"),
        (Weak, "breakaway = 0.35"),
        (Jumping, "jumps from"),
        (Negative, "at least 0"),
        (OtherNodes, "must begin with kinetic_at"),
        (Unsorted, "speeds must ascend"),
        (Constant, "constant is True"),
        (Empty, "must define nodes"),
        (Noisy, "method smooth"),
    ],
)
def test_wrong_friction_laws(law: type[wb.SmoothFriction], words: str) -> None:
    with pytest.raises(AssertionError, match=rf"(?s){law.__name__}.*{words}"):
        check_friction(law())


@pytest.mark.parametrize("law", [Smooth, SetValued])
def test_the_same_laws_without_the_fault(law: type[wb.SmoothFriction]) -> None:
    check_friction(law())
    check_brake(Brake(radius=0.2))
    check_signal(Pulse(5.0))


class Pulse(wb.Signal):
    height: float

    def primitive(self) -> wb.Signal:
        height = self.height
        return wb.Table([0.0, 0.5, 0.5, 1.0], [0.0, height, 0.0, 0.0], periodic=True)


class Low(Pulse):
    bound = 1.0


class Shorter(Pulse):
    period = 0.7


class Still(Pulse):
    varies = False


class Unknotted(Pulse):
    def knots(self, first: float, last: float) -> Any:  # noqa: ARG002
        return np.empty(0)


class Slow(wb.Signal):
    rate = 0.1

    def primitive(self) -> wb.Signal:
        return wb.Harmonic(1.0, 10.0)


class WrongIntegral(Pulse):
    def _integral(self, time: Any) -> Any:
        return 1.01 * super()._integral(time)


class WrongValues(Pulse):
    def _values(self, time: Any) -> Any:
        return 0.99 * super()._values(time)


class NotPrimitive(wb.Signal):
    def primitive(self) -> wb.Signal:
        return Pulse(1.0) + 1.0


class Halfway(Pulse):
    def _values(self, time: Any) -> Any:
        return np.where(time == 0.5, 0.5 * self.height, super()._values(time))


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        (Low(5.0), "bound = 1.0: must be at least"),
        (Shorter(5.0), "period = 0.7"),
        (Still(5.0), "varies is False"),
        (Unknotted(5.0), "not analytic"),
        (Slow(), "varies faster than rate"),
        (WrongIntegral(5.0), "by quadrature of the values"),
        (WrongValues(5.0), r"primitive\(\)"),
        (NotPrimitive(), "but has a Pulse"),
        (Halfway(5.0), "at its knots"),
    ],
)
def test_wrong_signals(signal: wb.Signal, words: str) -> None:
    with pytest.raises(AssertionError, match=words):
        check_signal(signal)


class Doubling(wb.Inertia):
    factor: float = wb.parameter("factor", example=2.0, gt=0, default=1.0)


class WrongExample(Doubling):
    factor: float = wb.parameter("factor", example=-2.0, gt=0, default=1.0)


class TakesNan(Doubling):
    factor: float = wb.parameter("factor", example=2.0, default=1.0, allow_inf_nan=True)


class EqualAnyhow(Doubling):
    def __eq__(self, other: object) -> bool:
        return isinstance(other, EqualAnyhow)

    def __hash__(self) -> int:
        return 1


class HashedByPlace(Doubling):
    def __hash__(self) -> int:
        return id(self)


class Mutable(Doubling):
    def __setattr__(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)


class Nameless(Doubling):
    def __repr__(self) -> str:
        return "<Nameless>"


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (WrongExample, "example -2.0 is out of its range"),
        (TakesNan, "factor = nan: must be refused"),
        (EqualAnyhow, "must not be equal"),
        (HashedByPlace, "same hash"),
        (Mutable, "must not be assigned"),
        (Nameless, "repr must be Python"),
    ],
)
def test_wrong_parts(part: type[wb.Inertia], words: str) -> None:
    with pytest.raises(AssertionError, match=rf"{part.__name__}.*{words}"):
        check_part(part("disc", 1.0))


def test_a_kind_that_reads_back_as_another_class() -> None:
    def defined() -> type[wb.Brake]:
        class Twice(Brake):
            kind = "twice"

        return Twice

    try:
        first = defined()
        check_brake(first(radius=0.2))
        defined()
        with pytest.raises(AssertionError, match="study file"):
            check_brake(first(radius=0.2))
    finally:
        wb.Brake.kinds.pop("twice")


class Stepped(Brake):
    def shape(self) -> tuple[float, ...]:
        return (float(math.floor(self.gain)),)


def test_a_parameter_without_a_derivative() -> None:
    with pytest.raises(AssertionError, match=r"Stepped.*brake\.gain"):
        check_derivatives(Stepped(radius=0.2, gain=2.0))
    check_derivatives(Brake(radius=0.2, gain=2.0))


@pytest.mark.parametrize("part", DISCS)
def test_parts_of_no_system_have_no_derivatives(part: Part) -> None:
    with pytest.raises(wb.InputError, match="part of a system"):
        check_derivatives(part)


@pytest.mark.parametrize(
    "check", [check_brake, check_derivatives, check_friction, check_signal, check_part]
)
def test_other_objects_are_refused(check: Any) -> None:
    with pytest.raises(wb.InputError, match="must be a"):
        check(0.3)
