"""Speed of the exact solver for machines: ``make bench``.

Two times of each run: of the compiled kernels alone, on a problem that is assembled already, and of
the solver from a machine to its answer; both without samples and without what makes a dataset, the
shortest of several runs, on one core. Cells are the Taylor steps, at most one between two events,
knots of a record or samplings. heyoka with terminal events and Siconos follow the same machines in
the same run, and are compared with the kernels; out/machines.json keeps this table for
docs/benchmarks.md. Study files: benchmarks/machines. ``python benchmarks/machines.py basins``
measures basins of attraction alone.
"""

import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import ours
import wedgebrake as wb
from pages import basin_table, machine_table
from peers import heyoka_events, heyoka_machine, heyoka_stops, moreau
from peers.brake import Brake
from timing import best
from wedgebrake.dynamics.enums import Outcome
from wedgebrake.solvers.machine.assemble import assemble
from wedgebrake.solvers.machine.final_state import start_state
from wedgebrake.solvers.machine.problem import EVENT, Run, run_of
from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask, solve_machine
from wedgebrake.solvers.machine.trajectory import trajectory
from wedgebrake.solvers.machine.trajectory.observers import Observer, observer_of
from wedgebrake.sweeps.executor import processors

HERE = Path(__file__).parent
RECORD = HERE.parent / "out" / "benchmarks" / "torque.csv"
STUDIES = {
    "paper": "paper's brake, 250 periods",
    "coupled_clutches": "coupled clutches",
    "four_inertias": "4 inertias, 2 contacts, 250 periods",
    "record": "record of 100 000 samples",
    "controller": "25 s with a sampled actuation of 1 kHz",
    "stop": "stop in 5 s, 4 inertias",
    "stiff_stop": "stop in 5 s, 4 inertias, stiff shafts",
}
MEASURED = HERE.parent / "out" / "machines.json"
MOST = 10**9
PERIODS = 250
MAP = 40  # points of an axis of basins
SECONDS = 2.0  # spent on each


def write_record() -> None:
    """A torque that wanders below 4 Hz, to the CSV file that a study cites."""
    rng = np.random.default_rng(1)
    times = np.arange(100_000) / 1000.0
    torque = np.zeros_like(times)
    for frequency in rng.uniform(0.2, 4.0, size=30):
        phase = rng.uniform(0.0, 2.0 * np.pi)
        torque += 7.0 * np.sin(2.0 * np.pi * frequency * times + phase)
    RECORD.parent.mkdir(parents=True, exist_ok=True)
    rows = np.column_stack([times, torque])
    np.savetxt(RECORD, rows, delimiter=",", header="time,torque", comments="", fmt="%.9g")


def solver(
    machine: wb.Machine, duration: float, method: str = "exact"
) -> Callable[[], MachineAnswer]:
    """The solver alone, without samples."""

    def run() -> MachineAnswer:
        task = MachineTask(
            0.0, duration, np.empty(0), None, until_rest=False, max_events=MOST, method=method
        )
        found = solve_machine(machine, task)
        assert found.final.time == duration
        return found

    return run


def kernel_time(machine: wb.Machine, duration: float, method: str = "exact") -> float:
    """Shortest time of the kernel ``trajectory.move`` [s]."""
    problem = assemble(machine, 0.0, curved=method == "smooth").problem
    stop, log = np.zeros(1, dtype=np.bool_), np.zeros(4096, EVENT)

    def prepare() -> tuple[Run, Observer]:
        run = run_of(problem)
        start_state(machine, problem, run)
        return run, observer_of(problem, np.empty(0))

    def work(run: Run, observer: Observer) -> None:
        outcome, begins = Outcome.LOG_FULL, True
        while outcome == Outcome.LOG_FULL:
            span = trajectory.Span(duration, MOST, MOST, False, begins, False, stop)
            outcome = trajectory.move(problem, run, span, log, observer).outcome
            begins = False
        assert outcome == Outcome.COMPLETED

    return best(work, SECONDS, prepare=prepare)


def line(name: str, machine: wb.Machine, duration: float, method: str = "exact") -> float:
    """Measure and print one machine; returns the time of the kernels [s]."""
    run = solver(machine, duration, method)
    answer = run()
    kernel, whole = kernel_time(machine, duration, method), best(run, SECONDS)
    events = answer.events.size
    print(f"  {name:<38}{1e3 * kernel:9.2f} ms{1e3 * whole:9.2f} ms", end="")
    print(f"{events:8} events{answer.cells:9} cells", end="")
    print(f"{1e9 * kernel / max(events, 1):9.0f} ns an event", end="")
    print(f"{1e9 * kernel / answer.cells:7.0f} ns a cell")
    return kernel


def head(title: str) -> None:
    """Print the title of a group of machines, and the names of the columns of times."""
    print(f"{title:<40}{'kernels':>9}   {'solver':>9}")


def measures(name: str) -> None:
    """Measure and print what is derived from the response of a stop."""
    study = wb.load_study(HERE / "machines" / f"{name}.toml")
    response = wb.simulate(study.system, study.run.duration)
    disc = wb.SemiInfiniteDisc(conductivity=50.0, density=7200.0, specific_heat=500.0, area=0.04)
    print("\nmeasures of the stop, with all that they simulate again", end="")
    for word, measure in {
        "stopping": lambda: wb.stopping(response),
        "order_map": lambda: wb.order_map(response, "velocity", "disc"),
        "temperature": lambda: wb.temperature(response, disc),
    }.items():
        measure()
        print(f"; {word} {1e3 * best(measure, SECONDS):.0f} ms", end="")
    print()


def row(count: int) -> wb.Machine:
    """Inertias in a row with shafts, and a brake on the first one."""
    parts = [wb.Inertia(f"i{n}", 1.0) for n in range(count)]
    shafts = [
        wb.Shaft(f"i{n}", f"i{n + 1}", stiffness=4000.0, damping=1.0) for n in range(count - 1)
    ]
    brake = wb.Contact(
        "i0", name="brake", brake=wb.ConventionalBrake(radius=0.2),
        friction=wb.CoulombFriction(kinetic=0.25, static=0.3),
        actuation=wb.Actuation(initial_force=1000.0),
    )  # fmt: skip
    last = wb.Shaft(f"i{count - 1}", "ground", stiffness=3000.0, damping=1.0)
    engine = wb.Torque("i0", wb.Harmonic(300.0, 10.0), name="engine")
    return wb.Machine(inertias=parts, shafts=[*shafts, last], contacts=[brake], torques=[engine])


def loops(brakes: int) -> wb.Machine:
    """Three inertias in a circle of clutches, with brakes on each and static peaks."""
    names, sizes = ("a", "b", "c"), (0.4, 1.1, 2.3)

    def contact(a: str, b: str, number: int) -> wb.Contact:
        return wb.Contact(
            a, b, name=f"{a}-{b}-{number}", brake=wb.ConventionalBrake(radius=0.1),
            friction=wb.CoulombFriction(kinetic=0.3, static=0.4),
            actuation=wb.Actuation(initial_force=100.0 + 37.0 * number),
        )  # fmt: skip

    clutches = [contact(a, b, n) for n, (a, b) in enumerate(zip(names, "bca", strict=True))]
    return wb.Machine(
        inertias=[wb.Inertia(name, size) for name, size in zip(names, sizes, strict=True)],
        shafts=[wb.Shaft("a", "ground", stiffness=900.0, damping=1.0)],
        contacts=[*clutches, *(contact(names[n % 3], "ground", n) for n in range(brakes))],
        torques=[
            wb.Torque("a", wb.Harmonic(40.0 * (1.0 + brakes), 2.3), name="first"),
            wb.Torque("c", wb.Harmonic(30.0 * (1.0 + brakes), 1.7), name="second"),
        ],
    )  # fmt: skip


def impacts() -> wb.Machine:
    """An inertia between two stops under a sine, an impact oscillator."""
    return wb.Machine(
        inertias=[wb.Inertia("mass", 1.0, speed=1.0)],
        shafts=[wb.Shaft("mass", "ground", stiffness=1e4, damping=2.0, gap=(-0.1, 0.1))],
        torques=[wb.Torque("mass", wb.Harmonic(20.0, 2.0))],
    )


def stops() -> list[dict[str, Any]]:
    """Measure and print the impact oscillator, beside heyoka as long as their motions agree.

    Returns the rows of the table; the errors are those after 5 s.
    """
    head("\nstops")
    case = "impact oscillator, 100 s"
    kernel = line(case, impacts(), 100.0)
    own = {"case": case, "program": "wedgebrake", "asked": "exact", "seconds": kernel, "ratio": 1.0,
           "error_velocity": 0.0, "error_angle": 0.0}  # fmt: skip
    model, short = heyoka_stops.Stops(impacts(), 100.0), heyoka_stops.Stops(impacts(), 5.0)
    if model.missing():
        return [own]
    motion, final = fastest(model.run), solver(impacts(), 5.0)().final
    expected = final.angles["mass"], final.speeds["mass"]
    angle, velocity = np.abs(np.asarray(short.run().state[:2]) - expected)
    print(f"  heyoka, tol 1e-15: {1e3 * motion.seconds:.2f} ms", end="")
    print(f", {motion.seconds / kernel:.1f} times; after 5 s the speeds differ by {velocity:.0e}")
    peer = {"program": "heyoka", "asked": "tol 1e-15", "seconds": motion.seconds,
            "ratio": motion.seconds / kernel, "error_velocity": float(velocity),
            "error_angle": float(angle)}  # fmt: skip
    return [own, own | peer]


def controlled(sample_time: float | None) -> wb.Machine:
    """A wheel that a brake stops whose force a controller holds."""
    return wb.Machine(
        inertias=[wb.Inertia("wheel", 40.0, speed=90.0)],
        contacts=[
            wb.Contact(
                "wheel", name="brake", brake=wb.WedgeBrake(angle=0.34, radius=0.15),
                friction=wb.CoulombFriction(kinetic=0.3, static=0.36),
                actuation=wb.Actuation(initial_force=0.0, lag=0.02),
            )
        ],
        controllers=[
            wb.Controller(
                "force", {"brake.force": 1.0}, 300.0, "brake.command", proportional=0.5,
                integral=20.0, limits=(0.0, 1500.0), sample_time=sample_time,
            )
        ],
    )  # fmt: skip


def belt() -> wb.Machine:
    """The stick-slip oscillator on a belt, with Stribeck friction, of examples/belt.toml."""
    machine = wb.load_study(HERE.parent / "examples" / "belt.toml").system
    assert isinstance(machine, wb.Machine)
    return machine


def slip_by_scipy(start: list[float], duration: float) -> tuple[float, float, int]:
    """(time taken [s], speed at the end, evaluations) of a slip of ``belt`` by DOP853."""
    calls = 0

    def rates(_t: float, y: np.ndarray) -> list[float]:
        nonlocal calls
        calls += 1
        return [y[1], -y[0] - 0.1 * y[1] + 0.5 + 0.5 * math.exp((y[1] - 0.5) / 0.5)]

    def run() -> float:
        options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
        return float(solve_ivp(rates, (0.0, duration), start, **options).y[1, -1])

    speed = run()
    calls = 0
    run()
    found = calls
    return best(run, SECONDS), speed, found


def friction_curve() -> None:
    """Measure and print friction as a curve, and one slip by SciPy."""
    print("\nStribeck friction as a curve, 5 000 s on a belt (800 cycles), and a slip of 1.5 s")
    whole = line("oscillator on a belt", belt(), 5000.0, "smooth")
    start, duration = [1.0, 0.4], 1.5
    machine = belt().replace({"mass.angle": start[0], "mass.speed": start[1]})
    answer = solver(machine, duration, "smooth")()
    taken, speed, calls = slip_by_scipy(start, duration)
    error = abs(speed - answer.final.speeds["mass"])
    print(f"  SciPy's DOP853 {1e3 * taken:.2f} ms for the slip, {calls} evaluations", end="")
    print(f"; speeds differ by {error:.1e} rad/s. All cycles: {1e3 * whole:.1f} ms")


def taken(call: Callable[[], object]) -> tuple[float, float]:
    """Time and processor time of all threads [s] of a call."""
    begin, work = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - begin, time.process_time() - work


def basins() -> dict[str, Any]:
    """Measure and print basins beside a limit cycle: the whole call, and a point of it."""
    fast = belt().replace({"belt.base_speed": 1.35})
    start = {
        "mass.angle": np.linspace(-1.5, 2.5, MAP), "mass.speed": np.linspace(-2.0, 2.0, MAP),
    }  # fmt: skip
    cases = {
        "the curve itself": (fast, "smooth"),
        "lines within 1e-4 of it": (fast, "exact"),
        "lines within 1e-3 of it": (fast.replace({"belt.tolerance": 1e-3}), "exact"),
    }
    found: dict[str, Any] = {"load": os.getloadavg()[0], "points": MAP**2, "rows": []}
    for words, (machine, method) in cases.items():
        for threads in (1, processors()):
            call = partial(wb.basins, machine, start, method=method, threads=threads)
            seconds, work = min(taken(call) for _ in range(2))
            row = {"friction": words, "threads": threads, "seconds": seconds, "work": work}
            found["rows"].append(row)
    print("\n" + basin_table(found))
    return found


def fastest(run: Callable[[], Any], most: int = MOST) -> Any:
    """The fastest of as many answers as are computed within ``SECONDS``."""
    answers = [run()]
    while sum(one.seconds for one in answers) < SECONDS and len(answers) < most:
        answers.append(run())
    return min(answers, key=lambda one: one.seconds)


def beside(name: str, kernel: float) -> Iterator[dict[str, Any]]:
    """The other programs on one machine, with their errors at the final state.

    kernel : time of the kernels [s]
    """
    study = wb.load_study(HERE / "machines" / f"{name}.toml")
    machine, until = study.system, study.run.duration
    final, names = solver(machine, until)().final, [one.name for one in machine.inertias]
    state = np.array([[kind[name] for name in names] for kind in (final.angles, final.speeds)])

    def row(program: str, asked: str, seconds: float, found: np.ndarray, **more: float) -> dict:
        angle, speed = np.abs(found.reshape(state.shape) - state).max(axis=1).tolist()
        return {
            "case": STUDIES[name], "program": program, "asked": asked, "seconds": seconds,
            "ratio": seconds / kernel, "error_angle": angle, "error_velocity": speed, **more,
        }  # fmt: skip

    yield row("wedgebrake", "exact", kernel, state)
    model = heyoka_machine.Model(machine, until, 1e-15)
    if not model.missing():
        motion = fastest(model.run)
        yield row("heyoka", "tol 1e-15", motion.seconds, motion.state, inside=motion.inside)
        if name == "paper":
            peer = heyoka_events.HeyokaEvents("coulomb", 1e-15)
            brakes = [Brake.of(wb.paper.system(eta=-60.0, F0=0.036))]
            answers = fastest(lambda: peer.solve(brakes, until))
            program = "heyoka, sticks in closed form"
            yield row(program, "tol 1e-15", answers.seconds, answers.states)
    for step in (1e-3, 1e-4):
        peer = moreau.Siconos(step)
        if not peer.missing() and name != "controller":
            # Each is a process of its own.
            answers = fastest(partial(peer.follow, machine, until), most=5)
            yield row("Siconos", f"step {step:g} s", answers.seconds, answers.states)


def main() -> None:
    """Measure and print."""
    write_record()
    load = os.getloadavg()[0]
    print(f"wedgebrake {wb.__version__}, load {load:.1f}\n")
    head("studies of benchmarks/machines")
    seconds = {}
    for name, words in STUDIES.items():
        study = wb.load_study(HERE / "machines" / f"{name}.toml")
        seconds[name] = line(words, study.system, study.run.duration)
    measures("stop")
    system = wb.paper.system(eta=-60.0, F0=0.036)
    fast = best(ours.kernel(system, None, PERIODS), SECONDS)
    print(f"\npaper's brake by the closed forms {1e3 * fast:.2f} ms", end="")
    print(f"; the general solver takes {seconds['paper'] / fast:.2f} times as long")
    rows = [row for name in STUDIES for row in beside(name, seconds[name])] + stops()
    found = {"load": load, "rows": rows}
    print("\n" + machine_table(found))
    head("a brake on the first in a row, 25 s")
    for count in range(1, 9):
        line(f"{count} inertia{'s'[: count > 1]}", row(count), 25.0)
    head("contacts in loops, 25 s")
    for brakes in (1, 4, 8):
        line(f"{brakes + 3} contacts, 3 inertias", loops(brakes), 25.0)
    head("\na brake with a closed-loop force, 25 s")
    line("controller at 1 kHz", controlled(0.001), 25.0)
    line("continuous controller", controlled(None), 25.0)
    friction_curve()
    found["basins"] = basins()
    MEASURED.write_text(json.dumps(found, indent=1), encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:] == ["basins"]:
        basins()
    else:
        main()
