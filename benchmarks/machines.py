"""Speed of the exact solver for machines: ``make bench``.

Times are those of the solver from a machine to its answer, without samples and without what makes
a dataset: the shortest of several runs, on one core. Cells are the Taylor steps, at most one
between two events, knots of a record or samplings. heyoka follows the paper's brake with terminal
events, in the same run. Study files: benchmarks/machines.
"""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

import ours
import wedgebrake as wb
from peers import heyoka_events
from peers.brake import Brake
from timing import best
from wedgebrake.solvers.machine.solve import MachineAnswer, MachineTask, solve_machine

HERE = Path(__file__).parent
RECORD = HERE.parent / "out" / "benchmarks" / "torque.csv"
STUDIES = {
    "paper": "paper's brake, 250 periods",
    "coupled_clutches": "coupled clutches",
    "four_inertias": "4 inertias, 2 contacts, 250 periods",
    "record": "record of 100 000 samples",
    "controller": "25 s under a controller of 1 kHz",
    "stop": "stop in 5 s, 4 inertias",
    "stiff_stop": "stop in 5 s, 4 inertias, stiff shafts",
}
MOST = 10**9
PERIODS = 250
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


def solver(machine: wb.Machine, duration: float) -> Callable[[], MachineAnswer]:
    """The solver alone, without samples."""

    def run() -> MachineAnswer:
        task = MachineTask(0.0, duration, np.empty(0), None, until_rest=False, max_events=MOST)
        found = solve_machine(machine, task)
        assert found.final.time == duration
        return found

    return run


def line(name: str, run: Callable[[], MachineAnswer]) -> float:
    """Measure and print one machine; returns its time [s]."""
    answer = run()
    seconds = best(run, SECONDS)
    events = answer.events.size
    print(f"  {name:<38}{1e3 * seconds:9.2f} ms {events:7} events {answer.cells:8} cells", end="")
    print(
        f"{1e9 * seconds / max(events, 1):10.0f} ns an event{1e9 * seconds / answer.cells:8.0f}",
        end="",
    )
    print(" ns a cell")
    return seconds


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


def main() -> None:
    """Measure and print."""
    write_record()
    print(f"wedgebrake {wb.__version__}, load {os.getloadavg()[0]:.1f}\n")
    print("studies of benchmarks/machines")
    seconds = {}
    for name, words in STUDIES.items():
        study = wb.load_study(HERE / "machines" / f"{name}.toml")
        seconds[name] = line(words, solver(study.system, study.run.duration))
    measures("stop")
    system = wb.paper.system(eta=-60.0, F0=0.036)
    fast = best(ours.kernel(system, None, PERIODS), SECONDS)
    print(f"\npaper's brake by the closed forms {1e3 * fast:.2f} ms", end="")
    print(f"; the general solver takes {seconds['paper'] / fast:.2f} times as long")
    peer = heyoka_events.HeyokaEvents("coulomb", 1e-15)
    if why := peer.missing():
        print(f"heyoka: {why}")
    else:
        brakes, until = [Brake.of(system)], PERIODS / system.excitation.frequency
        own = peer.solve(brakes, until)
        taken = min(peer.solve(brakes, until).seconds for _ in range(5))
        answer = solver(system.machine, until)().final
        error = abs(float(own.states[0, 1]) - answer.speeds["driveline"])
        print(f"heyoka with terminal events {1e3 * taken:.2f} ms", end="")
        print(f", {taken / seconds['paper']:.1f} times as long; speeds differ by {error:.1e} rad/s")
    print("\n1 to 8 inertias in a row, a brake on the first, 250 periods")
    for count in range(1, 9):
        line(f"{count} inertia{'s'[: count > 1]}", solver(row(count), 25.0))


if __name__ == "__main__":
    main()
