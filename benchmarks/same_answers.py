"""The same answers from two source trees: ``python benchmarks/same_answers.py FORMER [LATTER]``.

Each tree computes the public results of 200 random machines of ``tests/motion_truth`` and of the
paper's brake in a process of its own, on one processor and with one set of libraries. States and
numbers must agree to 1e-9 of their scale where the motion is not chaotic, counts, kinds and classes
exactly. FORMER and LATTER are ``src`` folders, as of a former commit in a git worktree, or files
that ``--compute`` has written.

Prints each difference; the exit status is 1 if there is one.
"""

import argparse
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
RTOL = 1e-9
# Of the random machines, how many are also followed as orbits, swept and integrated smoothly.
ORBITS, SWEEPS, SMOOTH = 60, 40, 30
# Periods over which rounding does not grow to RTOL in the most chaotic of the machines.
SHORT = 6


def _values(dataset, names):
    return {name: dataset[name].to_numpy() for name in names if name in dataset}


def _response(system, initial, **settings):
    import wedgebrake as wb

    found = wb.simulate(system, periods=SHORT, initial=initial, **settings)
    names = (
        "angle", "velocity", "brake_torque", "event_time", "event_kind", "stick_start", "stick_end",
        "stick_entry", "stick_exit", "poincare_angle", "poincare_velocity",
    )  # fmt: skip
    energy = {}
    if found.attrs["status"] == "completed":
        energy = _values(wb.energy(found), ("torque_work", "friction_heat", "viscous_loss"))
    return {"status": found.attrs["status"], **_values(found, names), **energy}


def _motion(system, initial):
    import wedgebrake as wb

    one = wb.motion(system, initial=initial, transient=300, periods=500)
    found = {"kind": one.kind, "order": one.order, "stick_class": one.stick_class}
    if one.kind not in ("chaotic", "quasi-periodic", "undecided"):
        measures = ("largest_exponent", "peak_torque", "stick_share", "friction_power")
        found |= {name: getattr(one, name) for name in measures}
    return found


def _stability(system):
    import wedgebrake as wb

    one = wb.stability(system)
    names = ("damping", "hopf_slope", "margin_eta")
    ways = {
        way: {name: getattr(getattr(one, way), name) for name in names}
        for way in ("forward", "backward")
    }
    return {"stable": one.stable, "locking": one.self_locking, **ways}


def _orbit(system):
    import wedgebrake as wb

    one = wb.orbit(system, order=1)
    if not one.found:
        return {"found": False}
    return {"found": True, "points": np.array(one.points), "multipliers": np.sort_complex(
        np.array(one.multipliers))}  # fmt: skip


def _sweep(system, initial):
    import wedgebrake as wb

    found = wb.sweep(
        system, eta=np.linspace(-8.0, 2.0, 6), initial=initial, periods=120, transient=100
    )
    kinds = _values(found, ("motion", "order", "stick_class", "status"))
    return {**kinds, **_values(found, ("sliding_damping",))}


def _machine(system, initial):
    """The machine of a driveline: its run, its stability and a sweep, with an order more too."""
    import wedgebrake as wb

    torque = system.excitation
    richer = wb.HarmonicTorque(torque.amplitude, torque.frequency, orders=[(2.0, 0.5, 0.3)])
    found = {}
    for name, line in (("sine", system), ("orders", system.replace(excitation=richer))):
        start = dict(zip(("driveline.angle", "driveline.speed"), initial, strict=True))
        machine = line.machine.replace(start)
        run = wb.simulate(machine, SHORT / torque.frequency)
        verdict = wb.stability(machine)
        swept = wb.sweep(
            machine, {"brake.slope": np.linspace(-8.0, 2.0, 3)}, periods=120, transient=100
        )
        found[name] = {
            **_values(run, ("angle", "velocity", "brake_torque", "event_time", "event_kind")),
            "stable": verdict.stable, "growth_rate": verdict.growth_rate,
            **_values(swept, ("motion", "order", "stick_class", "status")),
        }  # fmt: skip
    return found


def _branches():
    import wedgebrake as wb

    cases = (
        (wb.paper.system(F0=0.036), {"eta": (-10.0, -22.0)}),
        (wb.paper.system(F0=0.036, brake="conventional"), {"eta": (-10.0, -26.0)}),
        (wb.paper.system(eta=-24.0), {"F0": (0.09, 0.05)}),
    )
    for system, over in cases:
        found = wb.branches(system, **over)
        kept = ("kind", "value", "order", "scenario")
        names = [f"bifurcation_{name}" for name in kept if f"bifurcation_{name}" in found]
        yield {name: found[name].to_numpy() for name in names}


def answers():
    """(name, answers) of every machine."""
    import wedgebrake as wb

    sys.path.insert(0, str(ROOT / "tests"))
    from motion_truth.systems import cases, from_tables

    for number, one in enumerate(one for one in cases() if one["group"] == "random"):
        name, system, initial = one["name"], from_tables(one["system"]), tuple(one["initial"])
        yield f"{name}: response", _response(system, initial)
        yield f"{name}: motion", _motion(system, initial)
        yield f"{name}: stability", _stability(system)
        if number < ORBITS:
            yield f"{name}: orbit", _orbit(system)
        if number < SWEEPS:
            yield f"{name}: sweep", _sweep(system, initial)
            yield f"{name}: machine", _machine(system, initial)
        if number < SMOOTH and isinstance(system.friction, wb.CoulombFriction):
            law = wb.SmoothedFriction(kinetic=system.friction.kinetic)
            smooth = system.replace(friction=law)
            yield f"{name}: smooth response", _response(smooth, initial, rtol=1e-12)
            yield f"{name}: smooth motion", _motion(smooth, initial)
    for number, one in enumerate(_branches()):
        yield f"branches {number}", one


def differences(name, one, other):
    """What differs between two answers, in words."""
    if isinstance(one, dict):
        for key in one.keys() | other.keys():
            if key not in one or key not in other:
                yield f"{name}.{key}: in one tree alone"
            else:
                yield from differences(f"{name}.{key}", one[key], other[key])
        return
    first, second = np.asarray(one), np.asarray(other)
    if first.shape != second.shape:
        yield f"{name}: {first.shape} and {second.shape}"
    elif first.dtype.kind not in "fc":
        if not np.array_equal(first, second):
            yield f"{name}: {one} and {other}"
    elif first.size:
        scale = np.nanmax(np.abs(np.where(np.isfinite(first), first, 0.0)), initial=0.0) or 1.0
        same = np.isclose(first, second, rtol=RTOL, atol=RTOL * scale, equal_nan=True)
        if not np.all(same):
            worst = np.nanmax(np.abs(first - second)[~same])
            yield f"{name}: differs by {worst:.3g}, {worst / scale:.2g} of its scale"


def _computed(source):
    if source.is_file():
        return pickle.loads(source.read_bytes())  # noqa: S301 - written by this program
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "answers"
        subprocess.run(  # noqa: S603 - this program
            [sys.executable, __file__, "--compute", str(target)],
            check=True, env={**os.environ, "PYTHONPATH": str(source)},
        )  # fmt: skip
        return pickle.loads(target.read_bytes())  # noqa: S301 - written by this program


def main():
    """Compare two trees, or compute the answers of one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("former", nargs="?", type=Path)
    parser.add_argument("latter", nargs="?", type=Path, default=ROOT / "src")
    parser.add_argument("--compute", type=Path, help="a file to write this tree's answers to")
    given = parser.parse_args()
    if given.compute:
        given.compute.write_bytes(pickle.dumps(dict(answers())))
        return
    if given.former is None:
        parser.error("name the former src folder")
    former, latter = _computed(given.former), _computed(given.latter)
    found = list(differences("answers", former, latter))
    print(*found, sep="\n")
    print(f"{len(former)} answers, {len(found)} differences")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
