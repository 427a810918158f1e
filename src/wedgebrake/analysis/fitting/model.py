"""The columns of a trace as functions of the free parameters, with their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wedgebrake.analysis.derivatives.task import tangent_task, varying
from wedgebrake.analysis.fitting.numbers import MeasuredNumber, Numbers
from wedgebrake.analysis.fitting.observation import Observation
from wedgebrake.analysis.fitting.trace import Trace
from wedgebrake.arrays import FloatArray
from wedgebrake.errors import InputError
from wedgebrake.model.machine_parts import Driven
from wedgebrake.solvers.kernels import method_of
from wedgebrake.solvers.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

    from wedgebrake.analysis.derivatives.varied_response import VariedResponse
    from wedgebrake.model.machine import Machine
    from wedgebrake.model.system import BrakedDriveline
    from wedgebrake.solvers.machine.tangents import Neighbourhood, TangentTask

# Step of the derivative over time, in median intervals of the trace.
_STEP = 1e-3


@dataclass(frozen=True)
class Simulated:
    """A simulation of the trace with given values.

    values    : by name, of all free parameters
    responses : at the times of the trace, one for each segment; none if the system or its motion
                does not reach the end
    columns   : (k,) of each observation, as the trace would measure it
    """

    values: Mapping[str, float]
    responses: list[xr.Dataset]
    columns: list[FloatArray]

    @property
    def events(self) -> list[tuple[int, int]]:
        """Contact and kind of each event before the last sample of a segment, in their order."""
        found = list[tuple[int, int]]()
        for one in self.responses:
            kinds, contacts = one["event_kind"].to_numpy(), one.get("event_contact")
            numbers = np.zeros(kinds.size, int) if contacts is None else contacts.to_numpy()
            before = one["event_time"].to_numpy() < float(one["time"][-1])
            found += zip(numbers[before].tolist(), kinds[before].tolist(), strict=True)
        return found


class Linearised(NamedTuple):
    """The simulated columns of a trace for some values, and their derivatives.

    columns : (k,) for each observation
    changes : (k, parameters) for each observation
    """

    columns: list[FloatArray]
    changes: list[FloatArray]

    @classmethod
    def missing(cls, observations: list[Observation], parameters: int, count: int) -> Linearised:
        """Return columns of nan, for a run that does not reach the last sample."""
        nothing = np.full((count, parameters), np.nan)
        return cls([np.full(count, np.nan) for _ in observations], [nothing for _ in observations])


@dataclass
class Known:
    """What a model has computed.

    runs      : number of its simulations
    simulated : last simulation of each number of samples
    near      : the last values, and the neighbourhood of the machine that has them
    """

    runs: int = 0
    simulated: dict[int, Simulated] = field(default_factory=dict)
    near: tuple[Mapping[str, float], Neighbourhood] | None = None


@dataclass(frozen=True)
class Model:
    """What a system predicts for the columns of a trace.

    initial  : initial conditions at the first sample that the system does not hold, by name
    settings : ``time_shift``, scale and offset of each column, where they are not free
    progress : called after each simulation with the number of simulations so far, if not None
    numbers  : measured numbers that describe the run
    """

    system: BrakedDriveline | Machine
    trace: Trace
    observations: list[Observation]
    initial: Mapping[str, float]
    settings: Mapping[str, float]
    method: str | None = None
    progress: Callable[[int], None] | None = None
    numbers: Numbers | None = None
    _known: Known = field(default_factory=Known)

    @property
    def time_step(self) -> float:
        """Step of differences over time [s]."""
        return _STEP * float(np.median(np.diff(self.trace.time)))

    @property
    def runs(self) -> int:
        """Number of its simulations so far."""
        return self._known.runs

    def system_at(self, values: Mapping[str, float]) -> BrakedDriveline | Machine:
        """The system with other values."""
        own = {name: value for name, value in values.items() if self._is_own(name)}
        return self.system.replace(own) if own else self.system

    def value(self, name: str) -> float:
        """The value of a free parameter in the system itself."""
        given = {**self.settings, **self.initial}
        return given[name] if name in given else self.system.value(name)

    def measured_start(self, values: Mapping[str, float]) -> dict[str, float]:
        """The first sample of each free initial condition that a column measures.

        Nothing may depend on an initial condition at the start of a fit, such as a speed at which
        the brake holds.
        """
        found, names = {}, iter(self.system.initial_conditions)
        for body in self.system.machine.inertias:
            for variable in ("angle",) if isinstance(body, Driven) else ("angle", "velocity"):
                name = next(names)
                for one in self.observations if name in values else ():
                    if (one.part, one.variable) == (body.name, variable):
                        scale = self._setting(f"{one.column}.scale", values)
                        offset = self._setting(f"{one.column}.offset", values)
                        found[name] = float((self.trace.columns[one.column][0] - offset) / scale)
        return {name: value for name, value in found.items() if np.isfinite(value)}

    def _is_own(self, name: str) -> bool:
        return name not in self.settings and name not in self.initial

    def _setting(self, name: str, values: Mapping[str, float]) -> float:
        return values.get(name, self.settings[name])

    def _run(self, values: Mapping[str, float], count: int) -> dict[str, Any]:
        times = self.trace.time[:count] + self._setting("time_shift", values)
        run = {"start_time": float(times[0]), "times": times, "method": self.method}
        start = tuple(values.get(name, one) for name, one in self.initial.items())
        return {**run, "initial": start} if start else run

    def _tell(self) -> None:
        self._known.runs += 1
        if self.progress is not None:
            self.progress(self._known.runs)

    def simulate(self, values: Mapping[str, float], count: int) -> Simulated:
        """Simulate the first samples; nan where the system cannot have the values or stops."""
        run, kept = self._run(values, count), self._known.simulated.get(count)
        if kept is not None and kept.values == values:
            return kept
        missing = [np.full(count, np.nan) for _ in self.observations]
        try:
            response = simulate(self.system_at(values), float(np.ptp(run["times"])), **run)
        except InputError:
            return Simulated(values, [], missing)
        finally:
            self._tell()
        if response.sizes["time"] != count:
            return Simulated(values, [], missing)
        found = Simulated(dict(values), [response], self._columns(values, response))
        self._known.simulated[count] = found
        return found

    def _columns(self, values: Mapping[str, float], response: xr.Dataset) -> list[FloatArray]:
        """The columns of a response, as the trace would measure them."""
        return [
            self._setting(f"{one.column}.scale", values) * one.of(response)
            + self._setting(f"{one.column}.offset", values)
            for one in self.observations
        ]

    def linearised(self, values: Mapping[str, float], count: int) -> Linearised:
        """Simulate the columns at the first samples, and differentiate them.

        Raises ``InputError`` for a parameter without a derivative, and for values that the system
        cannot have.
        """
        names = list(values)
        own = [name for name in names if name not in self.settings]
        run = self._varied(values, own, count) if own else None
        if run is not None and not run.complete:
            return Linearised.missing(self.observations, len(names), count)
        self._tell()
        columns, changes = [], []
        for one in self.observations:
            if run is not None:
                column, each = self._observed_in(run, one, values)
            else:
                responses = self.simulate(values, count).responses
                given = one.of(responses[0]) if responses else np.full(count, np.nan)
                column, each = self._observed(one, values, given, np.empty((count, 0)))
            columns.append(column)
            changes.append(each)
        if "time_shift" in names:
            for rows, rate in zip(changes, self._rates(values, count), strict=True):
                rows[:, names.index("time_shift")] = rate
        return Linearised(columns, changes)

    def _observed_in(
        self, run: VariedResponse, one: Observation, values: Mapping[str, float]
    ) -> tuple[FloatArray, FloatArray]:
        """A column of a run, as the trace would measure it, and its derivatives."""
        place = run.place(one.variable, one.part)
        quantity, changes = run.values(one.variable), run.changes(one.variable)
        return self._observed(one, values, quantity[:, place], changes[..., place].T)

    def _observed(
        self, one: Observation, values: Mapping[str, float], quantity: FloatArray,
        changes: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
        """A column, as the trace would measure it, and its derivatives (k, parameters + more).

        quantity : (k,) that it measures
        changes  : (k, own + more) its derivatives with respect to the parameters that are the
                   system's own, and to more numbers
        """
        names = list(values)
        own = [number for number, name in enumerate(names) if name not in self.settings]
        more = changes.shape[1] - len(own)
        scale = self._setting(f"{one.column}.scale", values)
        each = np.zeros((quantity.size, len(names) + more))
        each[:, [*own, *range(len(names), len(names) + more)]] = scale * changes
        if f"{one.column}.scale" in names:
            each[:, names.index(f"{one.column}.scale")] = quantity
        if f"{one.column}.offset" in names:
            each[:, names.index(f"{one.column}.offset")] = 1.0
        return scale * quantity + self._setting(f"{one.column}.offset", values), each

    @property
    def numbers_each(self) -> list[MeasuredNumber]:
        """The measured numbers."""
        return [] if self.numbers is None else self.numbers.each

    def numbers_at(self, values: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
        """The measured numbers (r,) in a run, and their derivatives (r, parameters).

        They are nan where they do not exist, or the run does not reach the end of their window.

        Raises ``InputError`` as ``linearised``.
        """
        from wedgebrake.analysis.derivatives.varied_motion import run_motion, varied_motion

        if self.numbers is None:
            return np.empty(0), np.empty((0, len(values)))
        names, each = list(values), self.numbers.each
        found, changes = np.full(len(each), np.nan), np.zeros((len(each), len(names)))
        if not self.simulate(values, self.trace.time.size).responses:
            return found, changes
        own = [name for name in names if name not in self.settings]
        start, window = float(self.trace.time[0]), self.numbers.window
        task = self._task(values, own, start)._replace(span=(start, window[1]))
        varied = varied_motion(task, run_motion(task, window)).select(*window)
        self._tell()
        places = [names.index(name) for name in own]
        for row, one in enumerate(each):
            found[row], changes[row, places] = one.of(varied)
        return found, changes

    def _varied(self, values: Mapping[str, float], names: list[str], count: int) -> VariedResponse:
        """Run the machine up to the last of the first samples, with derivatives."""
        from wedgebrake.analysis.derivatives.varied_response import varied_response
        from wedgebrake.solvers.machine.tangents import Neighbourhood

        times = self._run(values, count)["times"]
        span = float(times[0]), float(times[-1])
        kept = self._known.near
        if kept is None or kept[0] != values:
            kept = dict(values), Neighbourhood(self._task(values, names, span[0]))
            self._known.near = kept
        kept[1].task.machine.check_times(*span)
        task = kept[1].task._replace(span=span, times=times)
        return varied_response(task, kept[1])

    def _task(self, values: Mapping[str, float], names: list[str], start: float) -> TangentTask:
        """Return the run to be differentiated, for some values; its end is set later [s]."""
        system = varying(self.system_at(values), names)
        initial = self._run(values, 1).get("initial")
        method = method_of(system, self.method)
        return tangent_task(system, names, (start, start), method, initial)

    def _rates(self, values: Mapping[str, float], count: int) -> list[FloatArray]:
        """Derivatives of the columns with respect to the shift of the time.

        A later start of the run is another run, as signals depend on time: differences.
        """
        step, shift = self.time_step, values["time_shift"]
        late, early = (
            self.simulate({**values, "time_shift": shift + sign * step}, count)
            for sign in (1.0, -1.0)
        )
        pairs = zip(late.columns, early.columns, strict=True)
        return [(one - other) / (2.0 * step) for one, other in pairs]
