"""The paper's experiment: 25 s from rest, the last 5 s taken as the steady motion.

Every run is done once and kept; many at a time are shared by the threads of the machine
(the kernels do not hold Python's lock).
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Hashable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wedgebrake.arrays import FloatArray
from wedgebrake.model.paper_machines import CORRECTED, DURATION, Assumptions, Case
from wedgebrake.model.system import BrakedDriveline
from wedgebrake.model.validation import check_choice
from wedgebrake.paper.fixed_step.simulate import ode14x
from wedgebrake.paper.visual_criteria import THRESHOLDS, Thresholds
from wedgebrake.solvers.simulate import simulate
from wedgebrake.sweeps.executor import processors

if TYPE_CHECKING:
    import xarray as xr


STEADY = 20.0
"""Beginning of the steady part of a run [s] (section 4)."""
SAMPLE, COARSE_SAMPLE = 1e-3, 2.5e-3
"""Time between samples [s]: ten of the paper's steps, far above any frequency it shows."""
STEP = 1e-4
"""The paper's fixed step [s]."""
RTOL = 1e-8

FRICTION = {"smooth": "smoothed", "exact": "coulomb", "ode14x": "smoothed"}
"""Method: the friction law it is used with. The paper's is ode14x with smoothed friction."""
METHOD_WORDS = {
    "smooth": f"smoothed friction, adaptive (rtol {RTOL:g})",
    "exact": "Coulomb friction, exact",
    "ode14x": f"smoothed friction, ODE14x ({STEP:g} s)",
}


@dataclass(frozen=True)
class SteadyRun:
    """A run after 20 s.

    status         : how the run ended, as in the attributes of a response
    end            : time of the end [s]
    angle, velocity: (n,) states at t = 20 s + n/f_e, up to 25 s [rad], [rad/s]; empty where
                     the run ended early
    """

    status: str
    end: float
    angle: FloatArray
    velocity: FloatArray

    @property
    def completed(self) -> bool:
        """The run reached 25 s."""
        return self.status == "completed"


def section_times(frequency: float) -> FloatArray:
    """Times of the paper's section, 20 s + n/f_e up to 25 s [s] (section 4.1)."""
    count = math.floor((DURATION - STEADY) * frequency * (1.0 + 1e-12))
    times: FloatArray = STEADY + np.arange(count + 1) / frequency
    return np.minimum(times, DURATION)


def run(system: BrakedDriveline, method: str, times: FloatArray, rtol: float = RTOL) -> xr.Dataset:
    """The paper's run of a system, seen at the given times."""
    if method == "ode14x":
        return ode14x(system, DURATION, times=times, step=STEP)
    return simulate(system, DURATION, method=method, times=times, rtol=rtol)


@dataclass(frozen=True, eq=False)
class Laboratory:
    """Runs of cases under one set of assumptions, by one method.

    method      : "smooth", "exact" or "ode14x"
    assumptions : what the paper leaves unsaid
    coarse      : few columns in diagrams, whose limits are not refined, and few samples
    rtol        : relative tolerance of "smooth"
    thresholds  : least features visible in pictures
    threads     : runs at a time; default one per processor
    watch       : called after each run with nothing, from any thread
    store       : threads and results, shared with laboratories made from this one

    A context: its end releases the threads, and runs not yet begun are dropped. Raises
    ``InputError`` for an unknown method.
    """

    method: str = "smooth"
    assumptions: Assumptions = CORRECTED
    coarse: bool = False
    rtol: float = RTOL
    thresholds: Thresholds = THRESHOLDS
    threads: int | None = None
    watch: Callable[[], None] = lambda: None
    store: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        check_choice("method", self.method, FRICTION)
        if self.store is None:
            object.__setattr__(self, "store", _Store(self.threads or processors(), self.watch))

    def like(self, **changed: Any) -> Laboratory:
        """Return another laboratory with the same threads and results; others as changed."""
        return replace(self, **changed)

    def __enter__(self) -> Laboratory:
        return self

    def __exit__(self, *_: object) -> None:
        self.store.pool.shutdown(wait=False, cancel_futures=True)

    def system(self, case: Case) -> BrakedDriveline:
        """Machine of a case."""
        return self.assumptions.system(case, FRICTION[self.method])

    def steady(self, case: Case) -> SteadyRun:
        """Last 5 s of a case."""
        return self.steadies([case])[0]

    def steadies(self, cases: Iterable[Case]) -> list[SteadyRun]:
        """Last 5 s of many cases, in their order."""
        return self._each(Laboratory._steady, cases)

    def response(self, case: Case) -> xr.Dataset:
        """All 25 s of a case, every ``SAMPLE``."""
        return self.responses([case])[0]

    def responses(self, cases: Iterable[Case]) -> list[xr.Dataset]:
        """All 25 s of many cases."""
        return self._each(Laboratory._response, cases)

    def once(self, what: Hashable, values: dict[str, Any], work: Callable[[], Any]) -> Any:
        """Return the stored result of some work, or do it: ``what`` and values identify it.

        It is done in the thread that asks; two at once may both do it.
        """
        about = (self.method, self.assumptions, self.coarse, self.rtol, self.thresholds)
        key = (what, *sorted(values.items()), *about)
        if key not in self.store.known:
            self.store.known[key] = work()
        return self.store.known[key]

    def _each(self, work: Callable[[Laboratory, Case], Any], cases: Iterable[Case]) -> list[Any]:
        about = (work, self.method, self.rtol, self.coarse)
        tasks = [((*about, self.assumptions.relevant(case), case), case) for case in cases]
        futures = self.store.submitted(tasks, lambda case: work(self, case))
        return [future.result() for future in futures]

    def _steady(self, case: Case) -> SteadyRun:
        system = self.system(case)
        response = run(system, self.method, section_times(system.excitation.frequency), self.rtol)
        status, end = str(response.attrs["status"]), float(response.attrs["final_time"])
        if status != "completed":
            return SteadyRun(status, end, np.empty(0), np.empty(0))
        return SteadyRun(status, end, response["angle"].to_numpy(), response["velocity"].to_numpy())

    def _response(self, case: Case) -> xr.Dataset:
        sample = COARSE_SAMPLE if self.coarse else SAMPLE
        times = np.linspace(0.0, DURATION, round(DURATION / sample) + 1)
        return run(self.system(case), self.method, times, self.rtol)


class _Store:
    """Threads, and the results of runs and of other work, that laboratories share."""

    def __init__(self, threads: int, watch: Callable[[], None]) -> None:
        self.pool = ThreadPoolExecutor(threads, thread_name_prefix="wedgebrake-paper")
        self.known: dict[Hashable, Any] = {}
        self._watch = watch
        self._lock = threading.Lock()
        self._runs: dict[Hashable, Future[Any]] = {}

    def submitted(
        self, tasks: list[tuple[Hashable, Case]], work: Callable[[Case], Any]
    ) -> list[Future[Any]]:
        def watched(case: Case) -> Any:
            result = work(case)
            self._watch()
            return result

        with self._lock:
            for key, case in tasks:
                if key not in self._runs:
                    self._runs[key] = self.pool.submit(watched, case)
            return [self._runs[key] for key, _ in tasks]
