"""Modes of a linear system: eigenvalues, or multipliers of a sampled system, with their shapes."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wedgebrake.analysis.linear_stability.linear_system import (
    INTERVALS,
    LinearSystem,
    acting_forces,
    held_step,
    sampled_system,
)
from wedgebrake.arrays import FloatArray
from wedgebrake.model.display import Result

ComplexArray = NDArray[np.complex128]

# Error of an eigenvalue relative to the largest one, per state.
_EIGENVALUE_ERROR = 2.0**-50
# Largest condition number of an eigenvalue; that of a multiple eigenvalue is unbounded.
_WORST = 2.0**20
# Smaller multipliers belong to delayed samples without further effect.
_GONE = 1e-12
# Share of the shape of a free rotation by which it may deviate from one, as shafts deform.
_RIGID = 1e-3
# Share of a contact's torque times its speed below which its power is rounding error.
_NO_POWER = 1e-12


@dataclass(frozen=True, repr=False, eq=False)
class Mode(Result):
    """A mode of small vibration about steady sliding, which varies as exp(eigenvalue t).

    eigenvalue    : growth rate and angular frequency, as a complex number [1/s]
    frequency     : of the damped vibration [Hz]; 0 if the mode does not oscillate
    growth_rate   : real part of the eigenvalue [1/s]; negative if the mode decays
    damping_ratio : -growth_rate/|eigenvalue| [1]; 0 for the eigenvalue 0
    shape         : (n,) complex amplitudes of the inertias, in their order; the largest is 1. All
                    are 0 if only actuators move
    fed_by        : name of the contact that feeds the most power into it; None if none does
    rigid         : a rotation that nothing holds or restrains; its eigenvalue is 0, and it does not
                    count as an instability
    drift         : a free rotation whose speed approaches a constant or departs from it, without
                    oscillation, since contacts or dampers act on it
    multiplier    : factor of the mode from sample to sample, if the command or a controller is
                    sampled; else None
    alternates    : the multiplier is negative: the mode changes its sign from sample to sample. Its
                    frequency, half the sampling rate, is not a natural frequency of the machine
    """

    eigenvalue: complex
    frequency: float
    growth_rate: float
    damping_ratio: float
    shape: ComplexArray
    fed_by: str | None = None
    rigid: bool = False
    drift: bool = False
    multiplier: complex | None = None
    alternates: bool = False

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mode) and self.as_dict() == other.as_dict()

    def __hash__(self) -> int:
        return hash((self.eigenvalue, self.fed_by))

    def as_dict(self) -> dict[str, Any]:
        """Plain values, complex numbers as [real, imaginary] pairs."""
        plain = dict(vars(self))
        for name in ("eigenvalue", "multiplier"):
            if plain[name] is not None:
                plain[name] = [plain[name].real, plain[name].imag]
        return plain | {"shape": [[one.real, one.imag] for one in self.shape.tolist()]}

    def _headline(self) -> str:
        if self.rigid:
            return "Rigid: free rotation"
        what = f"{self.frequency:.6g} Hz" if self.frequency > 0.0 else "No oscillation"
        what = "Drift of a free rotation" if self.drift else what
        if self.alternates:
            what = f"Alternates from sample to sample ({what}, half the sampling rate)"
        fed = f", fed by {self.fed_by}" if self.fed_by is not None else ""
        rates = f"growth rate {self.growth_rate:.4g} 1/s"
        if self.frequency > 0.0:
            rates += f", damping ratio {self.damping_ratio:.4g}"
        return f"{what}, {rates}{fed}"

    def _rows(self) -> Iterator[tuple[str, Any, str]]:
        units = {"eigenvalue": "1/s", "frequency": "Hz", "growth_rate": "1/s"}
        for name, value in vars(self).items():
            if value is not None:
                yield name, value, units.get(name, "")


@dataclass(frozen=True, eq=False)
class Spectrum:
    """All eigenvalues of a linear system, and its modes.

    eigenvalues : [1/s], the largest real part first; with samples those of the multipliers
    multipliers : from sample to sample, the largest magnitude first; None without samples
    modes       : the fastest-growing first, rigid ones last; one for each pair of complex
                  eigenvalues
    growth_rate : largest one of the modes that are not rigid [1/s]; -inf if there are none
    rounding    : growth rates up to this magnitude are rounding errors [1/s]
    """

    eigenvalues: tuple[complex, ...]
    multipliers: tuple[complex, ...] | None
    modes: tuple[Mode, ...]
    growth_rate: float
    rounding: float


def spectrum_of(system: LinearSystem, contacts: tuple[str, ...]) -> Spectrum:
    """The eigenvalues and modes of a linear system.

    contacts : names of its contacts

    Raises ``InputError`` for delays of samples that are too long.
    """
    part = None if system.sample_time is None else held_step(system)
    matrix = system.matrix if part is None else sampled_system(system, part)
    values, vectors = _eigen(matrix)
    multipliers, everywhere = None, vectors
    if system.sample_time is not None:
        kept = np.abs(values) > _GONE
        multipliers = values
        values, vectors = values[kept], vectors[:, kept]
    # Errors of multipliers are relative to 1 or more, those of rates to 0 or more.
    largest = float(np.abs(values).max(initial=0.0))
    if system.sample_time is not None:
        largest = max(largest, 1.0) / system.sample_time
    still = 0.0 if multipliers is None else 1.0
    # Free rotations that nothing restrains, up to rounding.
    neutral: Any = np.argsort(np.abs(values - still))[: system.neutral] if system.neutral else []
    values[neutral] = still
    rates = values
    if system.sample_time is not None:
        rates = _rates(system, values, vectors)
        rates[neutral] = 0.0
        # The states have different units, so that multipliers near 1 can be sensitive to rounding.
        moving = np.setdiff1d(np.arange(len(rates)), neutral)
        if moving.size:
            critical = moving[np.argmax(rates[moving].real)]
            largest *= _condition(everywhere, int(np.flatnonzero(kept)[critical]))
    elif len(matrix) > 2:
        largest *= _sensitivity(values, vectors, neutral)
    modes = []
    for number, rate in enumerate(rates.tolist()):
        if values[number].imag >= 0.0:
            multiplier = None if multipliers is None else complex(values[number])
            modes.append(
                _mode(
                    system, contacts, rate, vectors[:, number], multiplier, part,
                    rigid=number in neutral,
                )
            )  # fmt: skip
    one_each = None if multipliers is None else 1.0 + 0.0j
    modes.extend(_rigid(shape, one_each) for shape in system.free.T)
    modes.sort(key=lambda one: (one.rigid, -one.growth_rate, one.frequency))
    zeros = np.zeros(system.free.shape[1])
    everything = [complex(one) for one in (*rates, *zeros)]
    everything.sort(key=lambda one: (-one.real, abs(one.imag), -one.imag))
    if multipliers is not None:
        multipliers = np.concatenate([multipliers, zeros + 1.0])
        multipliers = multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
    return Spectrum(
        tuple(everything),
        None if multipliers is None else tuple(multipliers.tolist()),
        tuple(modes),
        max((one.growth_rate for one in modes if not one.rigid), default=-math.inf),
        _EIGENVALUE_ERROR * len(matrix) * largest,
    )


def growth_of(system: LinearSystem) -> Spectrum:
    """The growth rate of a linear system, as from ``spectrum_of`` but at a fraction of its cost.

    The system must not be sampled.
    """
    matrix = system.matrix
    values = _pair(matrix) if len(matrix) == 2 else np.linalg.eigvals(matrix).tolist()
    values = sorted(values, key=abs)
    growth = max((one.real for one in values[system.neutral :]), default=-math.inf)
    rounding = _EIGENVALUE_ERROR * len(values) * max(map(abs, values), default=0.0)
    if len(matrix) > 2 and rounding < abs(growth) <= rounding * _WORST:
        every, vectors = _eigen(matrix)
        rounding *= _sensitivity(every, vectors, np.argsort(np.abs(every))[: system.neutral])
    return Spectrum((), None, (), growth, rounding)


def _sensitivity(values: ComplexArray, vectors: ComplexArray, neutral: Any) -> float:
    """Condition number of the fastest-growing eigenvalue, in the best units of the states.

    It is large where two eigenvalues meet, as at the onset of flutter.

    neutral : numbers of the eigenvalues of free rotations
    """
    moving = np.setdiff1d(np.arange(len(values)), neutral)
    if not moving.size:
        return 1.0
    critical = moving[np.argmax(values[moving].real)]
    try:
        left = np.linalg.solve(vectors.T, np.eye(len(vectors))[critical])
    except np.linalg.LinAlgError:
        return _WORST
    found = float(np.abs(left) @ np.abs(vectors[:, critical]))
    return min(max(found, 1.0), _WORST) if math.isfinite(found) else _WORST


def _condition(vectors: ComplexArray, number: int) -> float:
    """Condition of an eigenvalue: its change per change of the matrix, at most ``_WORST``."""
    try:
        left = np.linalg.solve(vectors.T, np.eye(len(vectors))[number])
    except np.linalg.LinAlgError:
        return _WORST
    condition = float(np.linalg.norm(left) * np.linalg.norm(vectors[:, number]))
    return min(condition, _WORST) if math.isfinite(condition) else _WORST


def _eigen(matrix: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Eigenvalues, and eigenvectors as columns, of a real matrix; complex ones in pairs."""
    if len(matrix) == 2:
        values = np.array(_pair(matrix))
        if matrix[0, 1] == matrix[1, 0] == 0.0:
            return values, np.eye(2, dtype=complex)[:, :: 1 if matrix[0, 0] >= matrix[1, 1] else -1]
        return values, np.array([_vector(matrix, one) for one in values.tolist()]).T
    values, vectors = np.linalg.eig(matrix)
    return values.astype(complex), vectors.astype(complex)


def _pair(matrix: FloatArray) -> tuple[complex, complex]:
    """Eigenvalues of a real (2, 2) matrix, the larger real or the positive imaginary part first.

    The smaller of two real ones follows from the determinant, without cancellation.
    """
    (a, b), (c, d) = matrix.tolist()
    middle, square = 0.5 * (a + d), 0.25 * (a - d) ** 2 + b * c
    if square < 0.0:
        return complex(middle, math.sqrt(-square)), complex(middle, -math.sqrt(-square))
    large = middle + math.copysign(math.sqrt(square), middle)
    small = (a * d - b * c) / large if large != 0.0 else 0.0
    return complex(max(large, small)), complex(min(large, small))


def _vector(matrix: FloatArray, value: complex) -> tuple[complex, complex]:
    """An eigenvector of a real (2, 2) matrix that is not diagonal."""
    (a, b), (c, d) = matrix.tolist()
    one, other = (complex(b), value - a), (value - d, complex(c))
    # The larger one has lost the fewest digits.
    return max(one, other, key=lambda vector: abs(vector[0]) + abs(vector[1]))


def _rates(system: LinearSystem, multipliers: ComplexArray, vectors: ComplexArray) -> ComplexArray:
    """Logarithms of multipliers over the sample time [1/s].

    Several frequencies have the same samples; the one nearest to the motion of the state after a
    sample is taken, because a vibration can be faster than the sampling.
    """
    assert system.sample_time is not None  # noqa: S101 - only sampled systems
    size, turn = system.rates.shape[0], 2.0 * math.pi / system.sample_time
    forces = acting_forces(system, vectors)
    found = np.empty(len(multipliers), complex)
    for number, multiplier in enumerate(multipliers.tolist()):
        rate = cmath.log(multiplier) / system.sample_time
        state = vectors[:size, number]
        energy = (state.conj() @ system.weights @ state).real
        if multiplier.imag != 0.0 and energy > 0.0:
            moving = system.rates @ np.concatenate([state, forces[:, number]])
            frequency = (state.conj() @ system.weights @ moving).imag / energy
            rate += 1j * turn * round((frequency - rate.imag) / turn)
        found[number] = rate
    return found


def _mode(
    system: LinearSystem,
    contacts: tuple[str, ...],
    rate: complex,
    vector: ComplexArray,
    multiplier: complex | None,
    part: FloatArray | None,
    rigid: bool,
) -> Mode:
    """A mode, from its eigenvalue and eigenvector."""
    if rate.imag < 0.0:
        rate, vector = rate.conjugate(), vector.conj()
        multiplier = None if multiplier is None else multiplier.conjugate()
    shape = _normalised(system.basis @ vector[system.speeds])
    if rigid:
        return _rigid(shape, multiplier)
    fed_by = None
    powers = _powers(system, vector, part).tolist()
    most = max(powers, default=0.0)
    if most > 0.0:
        fed_by = contacts[powers.index(most)]
    size = abs(rate)
    return Mode(
        eigenvalue=rate,
        frequency=rate.imag / (2.0 * math.pi),
        growth_rate=rate.real,
        damping_ratio=(0.0 - rate.real) / size if size > 0.0 else 0.0,
        shape=shape,
        fed_by=fed_by,
        drift=rate.imag == 0.0 and _is_free(shape, system.free),
        multiplier=multiplier,
        alternates=multiplier is not None and multiplier.imag == 0.0 and multiplier.real < 0.0,
    )


def _is_free(shape: ComplexArray, free: FloatArray) -> bool:
    """Return True if all inertias move as in a free rotation.

    free : (n, r) orthonormal free rotations
    """
    rest = np.linalg.norm(shape - free @ (free.T @ shape))
    return bool(rest <= _RIGID * np.linalg.norm(shape)) and bool(np.any(shape))


def _rigid(shape: NDArray[Any], multiplier: complex | None) -> Mode:
    shape = _normalised(shape.astype(complex))
    return Mode(0j, 0.0, 0.0, 0.0, shape, rigid=True, multiplier=multiplier)


def _normalised(shape: ComplexArray) -> ComplexArray:
    """Amplitudes divided by the largest one; read-only."""
    largest = shape[np.argmax(np.abs(shape))]
    result = shape / largest if largest != 0.0 else shape.copy()
    result.setflags(write=False)
    return result


def _powers(system: LinearSystem, vector: ComplexArray, part: FloatArray | None) -> FloatArray:
    """Mean power of each contact into a mode, up to a factor; 0 where it is rounding error."""
    if part is None:
        torques, sliding = system.torques @ vector, system.sliding @ vector
        power, scale = (torques.conj() * sliding).real, np.abs(torques * sliding)
    else:
        states, inputs = _between_samples(system, vector, part)
        weights = np.array([1.0, *[4.0, 2.0] * (INTERVALS // 2 - 1), 4.0, 1.0])
        torques = system.torques @ np.concatenate([states, inputs])
        sliding = system.sliding @ states
        power = (torques.conj() * sliding).real @ weights
        scale = np.abs(torques * sliding) @ weights
    return np.where(np.abs(power) > _NO_POWER * scale, power, 0.0)


def _between_samples(
    system: LinearSystem, vector: ComplexArray, part: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """States and held forces at equidistant times between two samples."""
    size = system.rates.shape[0]
    path = [np.concatenate([vector[:size], acting_forces(system, vector[:, None])[:, 0]])]
    for _ in range(INTERVALS):
        path.append(part @ path[-1])
    states = np.array(path).T
    return states[:size], states[size:]
