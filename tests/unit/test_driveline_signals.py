"""Drivelines with signals: what is refused, by the names of the driveline."""

from __future__ import annotations

from typing import Any

import pytest

import wedgebrake as wb
from wedgebrake.model.study_run import Run

RECORD = wb.Table([0.0, 0.1], [1.0, 2.0])
REPEATED = wb.Table([0.0, 0.05, 0.1], [-300.0, 300.0, -300.0], periodic=True)
SYSTEM = wb.paper.system(eta=-24.0, F0=0.067)
SMOOTH = SYSTEM.replace(friction=wb.SmoothedFriction(kinetic=0.3, steepness=100.0))


def with_signal(part: str, signal: Any, system: Any = SYSTEM) -> Any:
    """The system with one of its values replaced by a signal."""
    if part == "excitation":
        return system.replace(excitation=signal)
    return system.replace(**{part.rpartition(".")[2]: signal})


PARTS = ["excitation", "driveline.drive_speed", "actuation.initial_force"]


@pytest.mark.parametrize("part", PARTS)
def test_the_signals_are_those_of_the_machine(part) -> None:
    system = with_signal(part, REPEATED)
    assert system.signals()[part] is not None
    assert set(system.signals()) == {"excitation", part}
    assert len(system.machine.signals()) == len(system.signals())
    assert (system.plain, SYSTEM.plain) == (False, True)


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    "call",
    [wb.motion, lambda system: wb.sweep(system, slope=[-40.0, -30.0])],
    ids=["motion", "sweep"],
)
def test_a_record_has_no_steady_motion(part, call) -> None:
    with pytest.raises(wb.InputError) as raised:
        call(with_signal(part, RECORD))
    assert raised.value.name == part
    assert isinstance(raised.value.value, wb.Table)


@pytest.mark.parametrize("part", PARTS)
def test_commands_report_on_the_machine(part, answer, tmp_path) -> None:
    machine = with_signal(part, REPEATED).machine_at(1e-3, -0.5)
    run = Run(duration=0.2, initial=(1e-3, -0.5))
    study = tmp_path / "signals.toml"
    study.write_text(wb.Study(with_signal(part, REPEATED), run).to_toml())
    assert answer("stability", study)["verdict"] == wb.stability(machine).verdict
    told, final = answer("simulate", study), wb.final_state(wb.simulate(machine, 0.2))
    assert told["final"] == {"time": 0.2, "angles": final.angles, "speeds": final.speeds}


def test_the_length_of_a_run_without_a_period_is_asked_for(run, tmp_path) -> None:
    study = tmp_path / "ramp.toml"
    study.write_text(wb.Study(with_signal("excitation", wb.Ramp(0.0, 300.0, 0.1)), Run()).to_toml())
    status, _, error = run("simulate", study)
    assert (status, "run.duration" in error) == (2, True)
    assert run("simulate", study, "--set", "duration=0.1")[0] == 0


@pytest.mark.parametrize("part", PARTS)
def test_a_run_beyond_a_record(part) -> None:
    system = with_signal(part, RECORD)
    with pytest.raises(wb.InputError) as raised:
        wb.simulate(system, 0.2)
    assert raised.value.name == part
    assert raised.value.value == pytest.approx(0.2)
    assert str(raised.value).startswith(f"{part}: ")
    whole = wb.simulate(system, RECORD.times[-1])
    assert whole.attrs["final_time"] == whole.time.values[-1] == RECORD.times[-1]


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    ("system", "method", "name"),
    [
        (SYSTEM, "ode14x", "method"),
        (SYSTEM, "exakt", "method"),
        (SMOOTH, None, "friction"),
        (SMOOTH, "smooth", "friction"),
    ],
)
def test_the_method_or_the_law_is_the_obstacle(system, method, name, part) -> None:
    """The signal is not: sweeps, runs and motions of other drivelines take it."""
    changed = with_signal(part, REPEATED, system)
    calls = [
        lambda: wb.sweep(changed, slope=[-40.0, -30.0], method=method),
        lambda: wb.motion(changed, method=method),
        lambda: wb.simulate(changed, 0.1, method=method),
    ]
    for call in calls:
        with pytest.raises(wb.InputError) as raised:
            call()
        assert raised.value.name == name
        assert raised.value.value == (method if name == "method" else system.friction)


def test_the_machine_is_the_way_out_of_a_refused_law() -> None:
    changed = with_signal("excitation", REPEATED, SMOOTH)
    found = wb.motion(changed.machine, transient=2, periods=6)
    assert found.status == "completed"


def test_the_machine_is_the_way_out_of_a_refused_orbit() -> None:
    changed = with_signal("excitation", REPEATED)
    with pytest.raises(wb.InputError) as raised:
        wb.orbit(changed)
    assert raised.value.name == "excitation"
    assert wb.orbit(changed.machine, order=1).period == pytest.approx(0.1)
