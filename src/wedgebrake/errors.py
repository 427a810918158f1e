"""Exceptions of the package."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Iterable
from typing import Any, Self, cast


class WedgebrakeError(Exception):
    """Base of every error that wedgebrake raises on purpose.

    name    : the argument, for example "disc.inertia"; None if it is not known
    value   : its value; None if it is missing or not known
    allowed : the allowed values in words, or a tuple of the allowed words; None if not known
    errors  : the single errors of one that reports several, otherwise the error itself
    """

    def __init__(
        self,
        message: str = "",
        *,
        name: str | None = None,
        value: Any = None,
        allowed: str | tuple[str, ...] | None = None,
    ) -> None:
        super().__init__(message)
        self.name, self.value, self.allowed = name, value, allowed
        self.errors: tuple[Self, ...] = cast("tuple[Self, ...]", (self,))
        # "name", " = ", "value" and what follows; a message that begins otherwise is all problem.
        self._value, self._problem = "", message
        if name is not None and message.startswith(name):
            self._problem = message[len(name) :]
            begin = f" = {shown(value)}"
            if self._problem.startswith(f"{begin}:"):
                self._value, self._problem = begin[3:], self._problem[len(begin) :]

    @classmethod
    def of(
        cls,
        name: str,
        value: Any,
        problem: str,
        *,
        allowed: str | tuple[str, ...] | None = None,
        said: str = "",
    ) -> Self:
        """Return the error "name = value: problem".

        problem : what is wrong, and the way out
        allowed : the allowed values, as the attribute
        said    : the value in the message; by default as it was given, shortened
        """
        said = said or shown(value)
        found = cls(f"{name} = {said}: {problem}", name=name, value=value, allowed=allowed)
        found._value, found._problem = said, f": {problem}"
        return found

    def __reduce__(self) -> Any:
        """The error and its attributes, so that copies and pickles keep them."""
        return _with_attributes, (type(self), self.args, dict(self.__dict__, errors=None))

    @classmethod
    def joined(cls, errors: Iterable[Self], more: str = "") -> Self:
        """Return one error that reports several; its attributes are those of the first.

        errors : one or more
        more   : a last line
        """
        every = tuple(single for one in errors for single in one.errors)
        first = every[0]
        text = "\n".join([*map(str, every), *([more] if more else [])])
        found = cls(text, name=first.name, value=first.value, allowed=first.allowed)
        if len(every) == 1 and not more:
            return every[0]
        found.errors = every
        return found

    def renamed(self, name_of: Callable[[str], str], sign: str = " = ", value: str = "") -> Self:
        """Return the error with other names of what is wrong.

        name_of : the new name of a name
        sign    : what stands between name and value
        value   : the value as the message says it, by default as it does
        """
        if len(self.errors) > 1:
            every = [one.renamed(name_of, sign, value) for one in self.errors]
            last = str(self).removeprefix("\n".join(map(str, self.errors))).strip()
            return self.joined(every, last)
        if self.name is None or name_of(self.name) == self.name:
            return self
        name, text = name_of(self.name), str(self)
        if text.startswith(self.name):
            said = f"{sign}{value or self._value}" if self._value else ""
            text = f"{name}{said}{self._problem}"
        found = type(self)(text, name=name, value=self.value, allowed=self.allowed)
        found._value, found._problem = value or self._value, self._problem
        return found


def _with_attributes(kind: type[WedgebrakeError], given: Any, attributes: Any) -> WedgebrakeError:
    found = kind(*given)
    found.__dict__.update(attributes, errors=(found,))
    return found


class InputError(WedgebrakeError, ValueError):
    """An argument or a study file is wrong; the message names it and the way out.

    name    : the argument, for example "disc.inertia"; None if it is not known
    value   : its value; None if it is missing or not known
    allowed : the allowed values in words, or a tuple of the allowed words; None if not known
    errors  : the single errors of one that reports several, otherwise the error itself

    If the message reports several errors, the other attributes describe the first.
    """


class OutputError(WedgebrakeError, OSError):
    """A result could not be written; nothing half-written is left."""


def shown(value: object) -> str:
    """Return a value as it was given, on one line, shortened if it is long and no path."""
    if isinstance(value, os.PathLike):
        return repr(os.fspath(value))
    if hasattr(value, "data_vars") or hasattr(value, "iloc"):
        return f"({type(value).__name__})"  # its text has many lines
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # thousands of digits, or of nested tables
        return f"({type(value).__name__} too long to show)"
    return text if len(text) <= 60 else text[:57] + "..."


# What people call a parameter, a group or a setting: symbols of docs/equations.md, and words whose
# spelling does not lead to the name. In lower case.
_MEANT = {
    **dict.fromkeys(("j", "mass", "moment_of_inertia"), ("inertia",)),
    **dict.fromkeys(("c", "damper", "viscosity"), ("damping",)),
    **dict.fromkeys(("k", "spring"), ("stiffness",)),
    "omega": ("drive_speed", "frequency", "speed"),
    **dict.fromkeys(("speed", "rpm", "shaft_speed"), ("drive_speed", "initial_velocity")),
    "omega_b": ("base_speed",),
    **dict.fromkeys(("t_a", "time_constant"), ("lag",)),
    "omega_a": ("frequency",),
    "zeta_a": ("damping_ratio",),
    **dict.fromkeys(("t_s", "sampling_time", "sample_period"), ("sample_time",)),
    "v_0": ("width", "speed"),
    "epsilon": ("tolerance",),
    "r": ("radius",),
    **dict.fromkeys(("alpha_w", "wedge_angle", "alpha"), ("angle", "brake_angle", "alpha")),
    "beta": ("wrap_angle",),
    "a": ("actuation_arm",),
    "b": ("normal_arm",),
    "d": ("friction_arm",),
    **dict.fromkeys(
        ("mu", "mu_k", "friction", "friction_coefficient", "kinetic_friction"),
        ("kinetic", "coefficients"),
    ),
    **dict.fromkeys(("mu_s", "mu_0", "static_friction"), ("static",)),
    **dict.fromkeys(("factor", "friction_factor"), ("scale",)),
    "v_r": ("speeds",),
    "xi": ("steepness",),
    "varsigma": ("decay",),
    **dict.fromkeys(
        ("f_a0", "f_a", "force", "actuation_force", "brake_force", "preload"),
        ("initial_force", "F0"),
    ),
    **dict.fromkeys(("delta", "gradient", "gain", "eta"), ("slope", "eta")),
    **dict.fromkeys(("t_e", "torque", "drive_torque", "torque_amplitude"), ("amplitude", "F0")),
    **dict.fromkeys(("f_e", "hz", "omega_e", "f"), ("frequency", "f")),
    **dict.fromkeys(("theta", "theta_0", "initial_angle"), ("initial_angle", "initial")),
    **dict.fromkeys(
        ("velocity", "omega_0", "initial_velocity", "initial_speed"),
        ("initial_velocity", "initial"),
    ),
    **dict.fromkeys(("x0", "y0", "state", "initial_state", "start"), ("initial",)),
    **dict.fromkeys(("time", "t_end", "t_max", "end_time"), ("duration",)),
    **dict.fromkeys(("tolerance", "tol"), ("rtol",)),
    **dict.fromkeys(("solver", "integrator"), ("method",)),
}

# Words that are nowhere allowed, and a sentence on what to use instead.
ELSEWHERE = {
    "ode14x": "For the paper's fixed-step scheme, use wb.paper.ode14x(system, ...).",
    **dict.fromkeys(
        ("step", "dt", "time_step"), "Only wb.paper.ode14x(system, ...) has a fixed step."
    ),
}


def nearest(word: str, allowed: Iterable[str], part: str = "") -> str:
    """A sentence that suggests the allowed words that mean ``word``, else the nearest to it.

    part : what precedes the words in a name, with its dot
    """
    if word.lower() in ELSEWHERE:
        return ELSEWHERE[word.lower()]
    allowed = sorted(set(allowed))
    close = [name for name in _MEANT.get(word.lower(), ()) if name in allowed]
    close = close or difflib.get_close_matches(word, allowed, n=3, cutoff=0.6)
    if not close:
        lowered = {name.lower(): name for name in allowed}
        close = [lowered[word.lower()]] if word.lower() in lowered else []
    if close:
        return "Did you mean " + " or ".join(repr(part + name) for name in close) + "?"
    if not allowed:
        return "There is none."
    return "Allowed: " + ", ".join(part + name for name in allowed) + "."
