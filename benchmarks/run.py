"""Speed of the solvers, beside peers in the same run: ``make bench``.

One thread. Work: the paper's wedge brake from rest over 25 s, about 250 torque periods, for
four cases. Times are the best of many runs; errors are those of the velocity at 25 s against
a converged solution. Peers that are not installed are left out with a word.
"""

import argparse
import platform
from collections.abc import Callable, Iterator

import numpy as np

import peers
import wedgebrake as wb
from timing import best
from wedgebrake._kernels import exact as exact_kernel
from wedgebrake._kernels import smooth as smooth_kernel
from wedgebrake._kernels.codes import COMPLETED
from wedgebrake._kernels.dop853 import SUMS
from wedgebrake.solvers import exact, smooth
from wedgebrake.solvers.trajectory import Clock

CASES = ((-24.0, 0.036), (-60.0, 0.036), (-24.0, 0.067), (0.0, 0.09))
TARGETS = {"exact": 0.45, "smooth": 3.0}  # ms for the first case
Row = tuple[str, str, float, float, str]


def coulomb_rows(case: tuple[float, float]) -> Iterator[Row]:
    """The exact solver and its peer on one case."""
    system = wb.paper.system(eta=case[0], F0=case[1])
    given = exact.problem(system)
    number, rest = Clock(given.omega).split(peers.END)
    log, points = exact_kernel.empty_log(0), np.empty((int(number), 2))
    start = (0, 0.0, 0.0, 0.0)

    def run():
        return exact_kernel.run(*given, *start, int(number), float(rest), 10**7, log, points)

    seconds, result = best(run), run()
    assert result[0] == COMPLETED
    events, evaluations = result[5], result[7]
    words = f"{events} events, {seconds / events * 1e9:.0f} ns and"
    words += f" {evaluations / events:.1f} evaluations each"
    yield "wedgebrake exact", "Coulomb", seconds, 0.0, words
    yield from peer_row(lambda: peers.heyoka_coulomb(system), "Coulomb", (result[3], result[4]))


def smoothed_rows(case: tuple[float, float]) -> Iterator[Row]:
    """The smooth solver at two tolerances and its peers on one case."""
    system = wb.paper.system(eta=case[0], F0=case[1], friction="smoothed")
    truth = wb.simulate(system, peers.END, rtol=1e-13, times=[peers.END])
    state = (float(truth.attrs["final_angle"]), float(truth.attrs["final_velocity"]))
    for rtol in (1e-8, 1e-10):
        given = smooth.problem(system, rtol)
        number, rest = Clock(given.plant[4]).split(peers.END)
        log = np.empty((20_000, smooth_kernel.LOG_COLUMNS))
        none = (np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 2)))
        work = np.empty((smooth_kernel.SCRATCH_ROWS, SUMS))
        no_trail = np.empty((0, smooth_kernel.TRAIL_COLUMNS))

        def run(
            given=given, number=number, rest=rest, log=log, none=none, work=work, trail=no_trail
        ):
            return smooth_kernel.run(
                *given, 0, 0.0, 0.0, 0.0, int(number), float(rest), 10**8, log, *none, work, trail
            )

        seconds, result = best(run), run()
        assert result[0] == COMPLETED
        error = abs(result[4] - state[1])
        yield f"wedgebrake smooth, rtol {rtol:g}", "smoothed", seconds, error, f"{result[5]} steps"
    yield from peer_row(lambda: peers.heyoka_smoothed(system, 1e-10), "smoothed", state)
    yield from peer_row(lambda: peers.scipy_smoothed(system, "LSODA", 1e-9), "smoothed", state)
    yield from peer_row(lambda: peers.scipy_smoothed(system, "DOP853", 1e-9), "smoothed", state)


def peer_row(make: Callable[[], peers.Peer], law: str, state: tuple[float, float]) -> Iterator[Row]:
    """One peer, or nothing and a word where it is not installed."""
    try:
        run, name = make()
    except ImportError as error:
        print(f"(left out: {error.name} is not installed)")
        return
    seconds = best(run, seconds=1.0, least=2)
    yield name, law, seconds, abs(run()[1] - state[1]), ""


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="the first case only")
    quick = parser.parse_args().quick
    print(f"wedgebrake {wb.__version__}, Python {platform.python_version()}, one thread\n")
    for case in CASES[:1] if quick else CASES:
        print(f"eta = {case[0]:g}, F0 = {case[1]:g}, 25 s")
        print(f"  {'solver':<46}{'law':<10}{'time':>10}{'ratio':>8}{'error':>10}")
        for rows in (list(coulomb_rows(case)), list(smoothed_rows(case))):
            first = rows[0][2]
            for name, law, seconds, error, words in rows:
                shown = f"{seconds * 1e3:9.3f} ms{seconds / first:7.1f}x{error:10.1e}"
                print(f"  {name:<46}{law:<10}{shown}  {words}")
        print()
    print(f"targets for the first case: {TARGETS['exact']} ms exact, {TARGETS['smooth']} ms smooth")


if __name__ == "__main__":
    main()
