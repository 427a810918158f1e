"""Signals: values, integrals and periods against closed forms."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import chirp

import wedgebrake as wb
from wedgebrake.dynamics.signals import turns

SINE = wb.Harmonic(500.0, 10.03, 0.3)
JUMPS = [0.0, 1.0, 1.0, 2.0], [0.0, 1.0, 3.0, 5.0]


def test_a_harmonic_is_a_sine_however_long_the_time() -> None:
    times = np.linspace(0.0, 2.0, 101)
    assert_allclose(SINE(times), 500.0 * np.sin(2.0 * np.pi * 10.03 * times + 0.3), atol=1e-10)
    # 2^30 periods of a frequency that floats hold exactly.
    late = wb.Harmonic(1.0, 1.25)
    assert_allclose(late(2.0**32 + times), late(times), atol=4e-6)
    assert_allclose(wb.Harmonic(1.0, 10.03)(1e7 + np.array([0.0])), [np.sin(0.0)], atol=1e-6)


@pytest.mark.parametrize("time", [0.1, 987.654321, 1e7 / 3.0, 2.0**40 / 7.0])
def test_the_turns_of_a_harmonic_are_exact_to_rounding_at_any_time(time: float) -> None:
    frequency, rest = 10.03, 1e-3 / 7.0
    exact = Fraction(frequency) * (Fraction(time) + Fraction(rest))
    error = float(Fraction(float(turns(frequency, time, rest))) - exact % 1)
    assert abs(error - round(error)) <= 4e-16


@pytest.mark.parametrize("after", ["error", "hold", "zero"])
def test_a_table_is_linear_and_takes_the_value_after_a_jump(after: str) -> None:
    table = wb.Table(*JUMPS, after=after)
    assert_allclose(table([0.0, 0.5, 1.0, 1.5, 1.999]), [0.0, 0.5, 3.0, 4.0, 4.998], rtol=1e-15)
    assert_allclose(table.integral([0.0, 0.5, 1.0, 2.0]), [0.0, 0.125, 0.5, 4.5], rtol=1e-15)


def test_what_a_table_is_outside_of_its_times() -> None:
    hold, zero = (wb.Table(*JUMPS, after=after) for after in ("hold", "zero"))
    outside = [-1.0, 2.0, 3.0]
    assert hold(outside).tolist() == [0.0, 5.0, 5.0]
    assert zero(outside).tolist() == [0.0, 0.0, 0.0]
    assert hold.integral(outside).tolist() == [0.0, 4.5, 9.5]
    assert zero.integral(outside).tolist() == [0.0, 4.5, 4.5]
    times = np.linspace(-1.0, 3.0, 41)
    assert zero.primitive()(times).tolist() == zero(times).tolist()
    table = wb.Table(*JUMPS)
    assert table.span == (0.0, 2.0)
    with pytest.raises(wb.InputError) as raised:
        table([1.0, 2.5])
    assert (raised.value.name, raised.value.value) == ("time", 2.5)


@pytest.mark.parametrize("after", ["error", "hold"])
def test_jumps_at_the_ends_of_a_table(after: str) -> None:
    table = wb.Table([0.0, 0.0, 1.0, 1.0], [9.0, 1.0, 2.0, 7.0], after=after)
    assert table([0.0, 0.5, 1.0]).tolist() == [1.0, 1.5, 7.0]
    assert table.integral([0.0, 1.0]).tolist() == [0.0, 1.5]
    assert wb.Table(table.times, table.values, after="zero").primitive()(1.0) == 0.0
    repeated = wb.Table(table.times, table.values, periodic=True)
    assert repeated([0.0, 1.0, 1.5, 2.0]).tolist() == [1.0, 1.0, 1.5, 1.0]


def test_a_periodic_table_repeats() -> None:
    table = wb.Table(*JUMPS, periodic=True)
    times = np.array([0.0, 0.25, 1.0, 1.75])
    for turn in (-2, -1, 1, 5):
        assert_allclose(table(times + 2.0 * turn), table(times), rtol=1e-14)
        assert_allclose(
            table.integral(times + 2.0 * turn), table.integral(times) + 4.5 * turn, rtol=1e-14
        )
    assert table.period == 2.0
    assert table.knots(0.0, 4.0).tolist() == [1.0, 2.0, 3.0]
    short = wb.Table([0.0, 0.125, 0.25], [0.0, 1.0, 0.0], periodic=True)
    assert_allclose(short.knots(-1.0, 3.0), np.arange(-0.875, 3.0, 0.125), rtol=1e-15)


def test_a_ramp() -> None:
    ramp = wb.Ramp(80.0, 0.0, 4.0, begin=1.0)
    assert ramp([0.0, 1.0, 3.0, 5.0, 9.0]).tolist() == [80.0, 80.0, 40.0, 0.0, 0.0]
    assert_allclose(ramp.integral([1.0, 5.0, 9.0]), [80.0, 240.0, 240.0])


def test_orders_follow_the_integral_of_the_speed() -> None:
    orders = wb.Orders(wb.Ramp(10.0, 20.0, 2.0), [(2.0, 1.5, 0.25), (0.5, -1.0, 0.0)])
    times = np.linspace(0.0, 2.0, 21)
    angle = 10.0 * times + 2.5 * times**2
    expected = 1.5 * np.sin(2.0 * angle + 0.25) - np.sin(0.5 * angle)
    assert_allclose(orders(times), expected, atol=1e-13)


def test_an_integral_keeps_its_digits_at_short_times() -> None:
    assert wb.Harmonic(1.0, 1.0).integral(1e-9) == pytest.approx(np.pi * 1e-18, rel=1e-14)


def test_algebra() -> None:
    times = np.linspace(0.0, 1.0, 11)
    values = SINE(times)
    assert_allclose((2.0 - SINE)(times), 2.0 - values)
    assert_allclose((SINE - 2)(times), values - 2.0)
    assert_allclose((-SINE)(times), -values)
    assert_allclose((np.float64(2.0) * SINE * SINE)(times), 2.0 * values**2)
    assert wb.Harmonic(500.0, 10.03, 0.3) + 1.0 == SINE + 1.0
    assert SINE + 1.0 != SINE + 2.0
    with pytest.raises(TypeError):
        SINE + "1"  # type: ignore[operator]


def test_periods() -> None:
    def sine(frequency: float) -> wb.Signal:
        return wb.Harmonic(1.0, frequency)

    assert sine(4.0).period == 0.25
    assert (sine(4.0) + sine(6.0)).period == pytest.approx(0.5, rel=1e-15)
    assert (sine(10.03) * sine(10.03 * 1.5)).period == pytest.approx(2.0 / 10.03, rel=1e-14)
    assert (sine(1.0) + sine(65.0)).period == pytest.approx(1.0)
    assert (sine(64.0) + sine(65.0)).period == pytest.approx(1.0)
    assert (sine(65.0) + sine(66.0)).period is None
    assert (sine(1.0) + sine(2.0**0.5)).period is None
    assert (sine(1.0) + wb.Ramp(0.0, 1.0, 1.0)).period is None
    assert (sine(1.0) + 0.0 * wb.Ramp(0.0, 1.0, 1.0)).period == 1.0
    assert wb.Constant(3.0).period == wb.Harmonic(0.0, 5.0).period == 0.0
    assert wb.Orders(2.0 * np.pi, [(3.0, 1.0, 0.0)]).period == pytest.approx(1.0 / 3.0)
    breathing = 2.0 * np.pi * (1.0 + 0.1 * sine(2.0))
    assert wb.Orders(breathing, [(3.0, 1.0, 0.0)]).period == pytest.approx(1.0)
    torque = wb.HarmonicTorque(500.0, 10.0, orders=[(0.5, 0.1, 0.0)])
    assert torque.period == pytest.approx(0.2)


def test_what_varies() -> None:
    ramp = wb.Ramp(1.0, 2.0, 1.0)
    assert ramp.varies
    assert (1.0 + ramp).varies
    assert wb.Table([0.0, 1.0], [2.0, 2.0], after="zero").varies
    for still in (
        wb.Constant(1.0), wb.Harmonic(0.0, 1.0), wb.Ramp(2.0, 2.0, 1.0), 0.0 * ramp,
        wb.Table([0.0, 1.0], [2.0, 2.0]), wb.Orders(0.0, [(1.0, 1.0, 0.0)]),
        wb.Orders(ramp, [(1.0, 0.0, 0.0)]),
    ):  # fmt: skip
        assert not still.varies


def test_orders_of_a_harmonic_torque() -> None:
    torque = wb.HarmonicTorque(500.0, 10.0, orders=((2.0, 0.5, 0.1), (0.5, 0.2, 0.0)))
    times = np.linspace(0.0, 0.3, 31)
    w = 20.0 * np.pi * times
    expected = 500.0 * (np.sin(w) + 0.5 * np.sin(2.0 * w + 0.1) + 0.2 * np.sin(0.5 * w))
    assert_allclose(torque(times), expected, atol=1e-11)
    assert_allclose(torque.torque(times), expected, atol=1e-11)


def test_a_signal_of_ones_own_states_its_primitive_alone() -> None:
    class Pulse(wb.Signal):
        """A force that acts from ``begin`` to ``end``."""

        force: float
        begin: float
        end: float

        def primitive(self) -> wb.Signal:
            times = [self.begin, self.begin, self.end, self.end]
            return wb.Table(times, [0.0, self.force, self.force, 0.0], after="hold")

    pulse = Pulse(5.0, begin=1.0, end=2.0)
    assert pulse([0.5, 1.0, 1.5, 2.0]).tolist() == [0.0, 5.0, 5.0, 0.0]
    assert pulse.integral(3.0) == 5.0
    assert pulse.varies
    assert pulse.period is None


def test_a_parameter_of_a_signal_has_a_name_of_its_own() -> None:
    with pytest.warns(UserWarning, match="shadows"), pytest.raises(wb.InputError) as raised:

        class Pulses(wb.Signal):
            period: float

    assert raised.value.name == "Pulses.period"


def test_a_kind_of_the_package_keeps_its_class() -> None:
    """A class of one's own must not take its place in study files, nor by inheriting its kind."""
    before = dict(wb.Signal.kinds)
    with pytest.raises(wb.InputError) as caught:

        class Other(wb.Signal):
            kind: ClassVar[str] = "harmonic"

            def primitive(self) -> wb.Signal:
                return wb.Constant(0.0)

    assert (caught.value.name, caught.value.value) == ("Other.kind", "harmonic")

    class Doubled(wb.Harmonic):
        def primitive(self) -> wb.Signal:
            return wb.Harmonic(2.0 * self.amplitude, self.frequency)

    assert Doubled(1.0, 2.0).kind_or_class == "Doubled"
    assert wb.Signal.kinds == before


def test_a_class_of_ones_own_may_be_defined_again(monkeypatch) -> None:
    """As a notebook does when a cell runs twice."""
    monkeypatch.setattr(wb.Signal, "kinds", {**wb.Signal.kinds})

    def defined() -> type[wb.Signal]:
        class Pulse(wb.Signal):
            kind: ClassVar[str] = "pulse"

            def primitive(self) -> wb.Signal:
                return wb.Constant(1.0)

        return Pulse

    defined()
    again = defined()
    assert wb.Signal.kinds["pulse"] is again


def test_a_record_may_die_away() -> None:
    table = wb.Table([0.0, 1.0, 2.0], [1.0, 1e-70, 1e-320])
    assert table(1.0) == 1e-70


def test_large_tables_integrate_to_rounding() -> None:
    times = np.linspace(0.0, 100.0, 100_001)
    table = wb.Table(times, np.full(times.size, 0.1))
    assert table.integral(100.0) == pytest.approx(10.0, rel=1e-15)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6, 0.5])
def test_the_lines_of_stribeck_friction_keep_their_tolerance(tolerance: float) -> None:
    law = wb.StribeckFriction(kinetic=0.2, static=0.35, speed=0.1, tolerance=tolerance)
    speeds, lines = np.transpose(law.nodes())
    at = np.linspace(0.0, 3.0, 100_001)
    error = np.interp(at, speeds, lines) - [law.kinetic_at(v) for v in at]
    assert np.abs(error).max() <= tolerance * (1.0 + 1e-9)
    assert lines[0] == law.breakaway == 0.35
    assert lines[-1] == 0.2
    assert np.all(np.diff(lines) < 0.0)


def test_stribeck_friction_takes_few_lines() -> None:
    """A convex curve needs sum of sqrt(mu'') dv / (4 sqrt(tolerance)) lines, to leading order."""
    law = wb.StribeckFriction(kinetic=0.2, static=0.35, speed=0.1, tolerance=1e-6)
    assert len(law.nodes()) - 1 <= 2.0 * np.sqrt(0.15) / (4.0 * np.sqrt(1e-6)) + 2
    assert wb.StribeckFriction(kinetic=0.2, speed=0.1).nodes() == ((0.0, 0.2),)


def test_equal_tables_are_equal_once_they_have_been_evaluated() -> None:
    one, other = (wb.Table([0.0, 1.0, 3.0], [0.0, 2.0, 1.0]) for _ in range(2))
    assert one(0.5) == other(0.5)
    assert one == other
    assert len({one, other}) == 1
    assert one != wb.Table([0.0, 1.0, 3.0], [0.0, 2.0, 1.0], after="hold")
    assert one != wb.Constant(1.0)


class TestChirps:
    TIMES = np.linspace(0.0, 4.0, 401)

    @pytest.mark.parametrize("ends", [(1.0, 30.0), (30.0, 1.0), (5.0, 5.0)])
    @pytest.mark.parametrize("law", ["linear", "log"])
    def test_values(self, ends: tuple[float, float], law: Any) -> None:
        """SciPy's chirp is a cosine; its phase is in degrees."""
        signal = wb.Chirp(2.0, *ends, 4.0, law)
        method = "linear" if law == "linear" else "logarithmic"
        right = 2.0 * chirp(self.TIMES, ends[0], 4.0, ends[1], method=method, phi=-90.0)
        assert signal(self.TIMES) == pytest.approx(right, abs=1e-12)

    def test_keeps_its_last_frequency(self) -> None:
        """After 4 s at 20 Hz on average, whole turns: a sine of 30 Hz."""
        signal = wb.Chirp(2.0, 10.0, 30.0, 4.0)
        later = 4.0 + self.TIMES
        assert signal(later) == pytest.approx(2.0 * np.sin(60.0 * np.pi * self.TIMES), abs=1e-11)
        assert signal.bound == 2.0
        assert signal.period is None

    @pytest.mark.parametrize("ends", [(2.0, 50.0), (-2.0, -0.5)])
    def test_log_ramp(self, ends: tuple[float, float]) -> None:
        signal = wb.Ramp(*ends, 4.0, 1.0, "log")
        right = ends[0] * (ends[1] / ends[0]) ** np.clip((self.TIMES - 1.0) / 4.0, 0.0, 1.0)
        assert signal(self.TIMES) == pytest.approx(right, rel=1e-14)
        assert signal([0.0, 1.0, 5.0, 1e9]) == pytest.approx([ends[0], ends[0], ends[1], ends[1]])

    def test_integral_of_a_log_ramp(self) -> None:
        """(end - start)/log(end/start) is the mean."""
        signal = wb.Ramp(2.0, 50.0, 4.0, law="log")
        assert signal.integral(4.0) == pytest.approx(4.0 * 48.0 / np.log(25.0), rel=1e-14)

    @pytest.mark.parametrize(
        ("make", "name"),
        [
            (lambda: wb.Ramp(0.0, 1.0, 1.0, law="log"), "signal.end"),
            (lambda: wb.Ramp(-1.0, 1.0, 1.0, law="log"), "signal.end"),
            (lambda: wb.Ramp(1.0, 2.0, 1.0, law="octaves"), "signal.law"),
            (lambda: wb.Chirp(1.0, 0.0, 1.0, 1.0), "signal.start"),
            (lambda: wb.Chirp(1.0, 1.0, -1.0, 1.0), "signal.end"),
            (lambda: wb.Chirp(1.0, 1.0, 2.0, 0.0), "signal.duration"),
        ],
    )
    def test_wrong(self, make: Any, name: str) -> None:
        with pytest.raises(wb.InputError) as caught:
            make()
        assert caught.value.name == name
