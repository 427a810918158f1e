"""Poincare sections, spectra, sticks and stability maps of machines, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import wedgebrake as wb
from machines import contact, single
from wedgebrake.analysis.responses.contacts import contact_summary

EXAMPLES = Path(__file__).parents[2] / "examples"
# x'' + 0.1 x' + x = mu(v) with mu = 0.5 + 0.5 exp(-v/0.5), on a belt of 0.5 m/s.
BELT = wb.load_study(EXAMPLES / "belt.toml").system
CLUTCH = wb.load_study(EXAMPLES / "clutch.toml").system
SMOOTH = {"method": "smooth"}
TWO = wb.Machine(
    inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 1.0)],
    shafts=[wb.Shaft("a", "b", stiffness=100.0)],
    torques=[wb.Torque("a", wb.Harmonic(1.0, 2.0))],
)
DRIVEN = wb.Machine(
    inertias=BELT.inertias,
    shafts=BELT.shafts,
    contacts=BELT.contacts,
    torques=[wb.Torque("mass", wb.Harmonic(0.3, 0.2))],
)


class TestPoincare:
    def test_a_contact_that_begins_to_slide(self):
        """The belt releases the mass where spring and damper reach the static friction."""
        points = wb.poincare(BELT, crossings=12, transient=8, section="belt", **SMOOTH)
        assert points.crossing.to_numpy().tolist() == [8, 9, 10, 11, 12]
        np.testing.assert_allclose(points.velocity, 0.5, rtol=1e-12)
        np.testing.assert_allclose(points.angle, 1.0 - 0.1 * 0.5, rtol=1e-12)
        response = wb.simulate(BELT, 100.0, **SMOOTH)
        np.testing.assert_allclose(points.time, response.stick_end[7:12], rtol=1e-12)

    def test_numbers_of_slips_do_not_depend_on_the_transient(self):
        few = wb.poincare(BELT, crossings=90, transient=80, section="belt", **SMOOTH)
        more = wb.poincare(BELT, crossings=90, transient=0, section="belt", **SMOOTH)
        assert more.crossing.to_numpy().tolist() == list(range(1, 91))
        np.testing.assert_allclose(few.time, more.time[79:], rtol=1e-11)

    @pytest.mark.parametrize("section", [None, "mass"])
    def test_a_speed_that_rises_through_the_middle_of_its_range(self, section):
        points = wb.poincare(BELT, crossings=40, transient=30, section=section, **SMOOTH)
        assert points.sizes == {"crossing": 11, "inertia": 1}
        assert points.attrs["section"] == "mass"
        period = wb.motion(BELT, **SMOOTH).period
        np.testing.assert_allclose(np.diff(points.time), period, rtol=1e-9)
        times = points.time[0].item() + np.linspace(0.0, period, 4001)
        cycle = wb.simulate(BELT, times[-1], times=times, **SMOOTH).velocity
        middle = 0.5 * (cycle.min() + cycle.max())
        assert points.attrs["section_level"] == pytest.approx(middle.item(), abs=1e-6)
        np.testing.assert_allclose(points.velocity, points.attrs["section_level"], rtol=1e-9)
        assert cycle[1].item() > cycle[0].item()

    def test_of_a_driveline_is_that_of_its_machine(self):
        system = wb.paper.system().replace(amplitude=0.0, drive_speed=2.0, slope=-5.0)
        one = wb.poincare(system, crossings=30, transient=20)
        other = wb.poincare(system.machine, crossings=30, transient=20)
        assert one.angle.dims == ("crossing",)
        for name in ("angle", "velocity"):
            assert np.array_equal(one[name], other[name].sel(inertia="driveline"))

    def test_of_a_driven_machine_is_its_response_once_in_a_period(self):
        points = wb.poincare(DRIVEN, periods=20, transient=10, section_time=0.5, **SMOOTH)
        times = 0.5 + 5.0 * np.arange(10, 21)
        response = wb.simulate(DRIVEN, times[-1], times=times, **SMOOTH)
        assert points.period.to_numpy().tolist() == list(range(10, 21))
        np.testing.assert_allclose(points.time, times, rtol=1e-15)
        np.testing.assert_allclose(points.velocity, response.velocity, rtol=1e-12)
        assert points.attrs["section_phase"] == pytest.approx(0.1)

    @pytest.mark.parametrize("section", ["mass", "belt"])
    def test_steady_sliding_does_not_return(self, section):
        fast = BELT.replace({"belt.base_speed": 3.0})
        points = wb.poincare(fast, crossings=30, transient=20, section=section, **SMOOTH)
        assert points.sizes["crossing"] == 0

    @pytest.mark.parametrize(
        ("system", "arguments", "name"),
        [
            (BELT, {"periods": 50}, "periods"),
            (BELT, {"section": "disc"}, "section"),
            (BELT, {"crossings": 20, "transient": 20}, "transient"),
            (BELT, {"section_time": 1.0}, "section_time"),
            (TWO, {"initial": (0.0, 1.0)}, "initial"),
            (BELT, {"rtol": 1e-6}, "rtol"),
            (DRIVEN, {"crossings": 50}, "crossings"),
            (DRIVEN, {"section": "mass"}, "section"),
            (wb.paper.system(), {"crossings": 50}, "crossings"),
        ],
    )
    def test_wrong_arguments(self, system, arguments, name):
        with pytest.raises(wb.InputError) as caught:
            wb.poincare(system, **arguments)
        assert caught.value.name == name


class TestSpectrum:
    def test_a_line_has_the_amplitude_of_the_linear_response(self):
        """Two inertias without contacts: the response to a sine is that of linear algebra."""
        stiffness, damping, amplitude, frequency = 100.0, 5.0, 3.0, 2.0
        machine = wb.Machine(
            inertias=[wb.Inertia("a", 1.0), wb.Inertia("b", 2.0)],
            shafts=[
                wb.Shaft("a", "ground", stiffness=stiffness, damping=damping),
                wb.Shaft("a", "b", stiffness=stiffness, damping=damping),
            ],
            torques=[wb.Torque("b", wb.Harmonic(amplitude, frequency))],
        )
        w = 2.0 * math.pi * frequency
        joint = stiffness + 1j * w * damping
        dynamic = np.array([[2.0 * joint - w * w, -joint], [-joint, joint - 2.0 * w * w]])
        expected = abs(np.linalg.solve(dynamic, [0.0, amplitude]))
        response = wb.simulate(machine, 60.0, times=np.linspace(0.0, 60.0, 6001))
        for name, size in zip("ab", expected, strict=True):
            lines = wb.spectral_lines(wb.spectrum(response, "angle", start=50.0, part=name))
            assert lines.attrs["forcing_frequency"] == pytest.approx(frequency)
            assert lines.label[0].item() == "f_e"
            assert lines.amplitude[0].item() == pytest.approx(size, rel=1e-6)

    def test_a_self_excited_motion_has_no_forcing_frequency(self):
        found = wb.spectrum(wb.simulate(BELT, 200.0, **SMOOTH), start=50.0)
        assert found.attrs["forcing_frequency"] == 0.0
        assert found.attrs["natural_frequency"] == pytest.approx(0.5 / math.pi)
        strongest = wb.spectral_lines(found).frequency[0].item()
        assert strongest == pytest.approx(1.0 / wb.motion(BELT, **SMOOTH).period, rel=1e-3)

    def test_a_part_is_named_where_there_are_several(self):
        response = wb.simulate(CLUTCH, 1.0)
        one = wb.spectrum(response, part="engine")
        assert one.equals(wb.spectrum(response.sel(inertia="engine")))
        assert wb.spectrum(response, "brake_torque", part="clutch").amplitude.max() > 0.0
        for arguments in ({}, {"part": "clutch"}, {"quantity": "brake_torque", "part": "load"}):
            with pytest.raises(wb.InputError):
                wb.spectrum(response, **arguments)


class TestSticks:
    def test_are_those_of_one_contact(self):
        response = wb.simulate(CLUTCH, 3.0)
        found = wb.sticks(response, contact="clutch")
        own = response.stick_contact.to_numpy() == 0
        assert np.array_equal(found.start, response.stick_start[own])
        assert np.array_equal(found.end, response.stick_end[own])
        assert found.attrs["count"] == own.sum()
        assert found.attrs["class"] == "at rest"
        # The shaft turns with the load.
        last = wb.sticks(response, 0.55, contact="clutch")
        assert last.attrs["share"] == pytest.approx((3.0 - 1.66364144279) / 2.45, abs=1e-9)
        with pytest.raises(wb.InputError):
            wb.sticks(response)
        response = wb.simulate(wb.paper.system(), periods=2)
        assert wb.sticks(response, contact="brake").identical(wb.sticks(response))
        with pytest.raises(wb.InputError, match=r"^contact = 'clutch'"):
            wb.sticks(response, contact="clutch")

    def test_of_a_machine_are_those_of_its_driveline(self):
        system = wb.paper.system()
        one = wb.sticks(wb.simulate(system, 2.0))
        other = wb.sticks(wb.simulate(system.machine, 2.0))
        for name in ("start", "end", "entry", "exit"):
            np.testing.assert_allclose(other[name], one[name], rtol=1e-9)
        assert other.attrs["share"] == pytest.approx(one.attrs["share"], rel=1e-8)
        assert other.attrs["class"] == one.attrs["class"]


@pytest.mark.parametrize(
    ("machine", "peak"),
    [
        # Half of the force, which is 1000 N + 200 N sin(6 pi t).
        (single(contact(force=wb.Harmonic(200.0, 3.0) + 1000.0, base_speed=1e3), stiffness=1e4),
         600.0),
        (single(contact(force=1000.0), torque=wb.Harmonic(30.0, 3.0)), 30.0),
    ],
    ids=["slides", "holds"],
)  # fmt: skip
def test_largest_torque_is_found_between_the_samples(machine, peak) -> None:
    found = contact_summary(wb.simulate(machine, 1.0, times=[1.0]))
    np.testing.assert_allclose(found.peak_torque, peak, rtol=1e-12)


class TestStabilityMap:
    def test_over_the_speed_of_a_belt_is_the_closed_form(self):
        """The damping ratio is half of 0.1 + mu'(v), with mu' = -exp(-2 v)."""
        speeds = np.linspace(0.2, 2.0, 19)
        found = wb.stability_map(BELT, {"belt.base_speed": speeds})
        ratio = 0.5 * (0.1 - np.exp(-2.0 * speeds))
        np.testing.assert_allclose(found.damping_ratio, ratio, atol=1e-12)
        np.testing.assert_allclose(found.growth_rate, -ratio, atol=1e-12)
        frequency = np.sqrt(1.0 - ratio**2) / (2.0 * math.pi)
        np.testing.assert_allclose(found.frequency, frequency, rtol=1e-12)
        assert np.array_equal(found.stable, speeds > 0.5 * math.log(10.0))
        assert not found.locked.any()

    def test_points_are_those_of_stability(self):
        line = wb.load_study(EXAMPLES / "driveline.toml").system
        line = line.replace({"brake.initial_force": 2e3})
        axes = {"brake.initial_force": [1e3, 3e3], "brake.slope": [-20.0, 0.0, 5.0]}
        found = wb.stability_map(line, axes)
        assert found.stable.dims == tuple(axes)
        assert found["brake.slope"].units == "N s/rad"
        for i, force in enumerate(axes["brake.initial_force"]):
            for j, slope in enumerate(axes["brake.slope"]):
                changed = line.replace({"brake.initial_force": force, "brake.slope": slope})
                alone = wb.stability(changed)
                assert found.stable[i, j].item() == alone.stable
                assert found.growth_rate[i, j].item() == alone.growth_rate

    def test_parameters_of_a_driveline_are_those_of_its_machine(self):
        system, slopes = wb.paper.system(), [-60.0, -3.0, 10.0]
        found = wb.stability_map(system, slope=slopes)
        expected = wb.stability_map(system.machine, {"brake.slope": slopes})
        assert found.stable.to_numpy().tolist() == [False, False, True]
        np.testing.assert_array_equal(found.growth_rate, expected.growth_rate)
        assert wb.plot(found).axes

    def test_a_brake_that_locks_itself_does_not_slide(self):
        machine = wb.paper.system().machine
        found = wb.stability_map(
            machine, {"brake.angle": [0.2, 0.5], "brake.base_speed": [-2.0]}
        ).squeeze()
        assert found.locked.to_numpy().tolist() == [True, False]
        assert math.isnan(found.damping_ratio[0].item())

    @pytest.mark.parametrize(
        "axes",
        [{}, {"belt.sped": [1.0]}, {"belt.base_speed": []}, {"belt.base_speed": [math.nan]},
         {"mass.inertia": [-1.0]}, {"belt.base_speed": "fast"}],
    )  # fmt: skip
    def test_wrong_axes(self, axes):
        with pytest.raises(wb.InputError):
            wb.stability_map(BELT, axes)

    def test_an_axis_is_given_once(self):
        with pytest.raises(wb.InputError):
            wb.stability_map(wb.paper.system(), {"eta": [1.0]}, eta=[1.0])
