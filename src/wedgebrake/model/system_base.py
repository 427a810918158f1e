"""What can be asked of every system, a braked driveline or a machine."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar, Self

from wedgebrake.errors import InputError
from wedgebrake.model.display import Tabular
from wedgebrake.model.groups import Groups
from wedgebrake.model.part import Part, Quantity
from wedgebrake.model.signals.signal_calculus import common_period
from wedgebrake.model.signals.signals import Signal, check_known
from wedgebrake.model.view import View

if TYPE_CHECKING:
    from wedgebrake.model.machine import Machine
    from wedgebrake.model.system import BrakedDriveline


class System(Part, Tabular):
    """A way to say a machine: with its names for parameters, and its view of results."""

    view: ClassVar[View]
    """How results of the machine are shown for this system."""
    default_length: ClassVar[Mapping[str, Any]]
    """Length of a run of ``simulate`` for which a study states none."""
    holds_start: ClassVar[bool]
    """Whether initial angles and speeds are parameters of the system, not arguments of runs."""
    elsewhere: ClassVar[Mapping[str, str]] = {}
    """Names of other systems that this one does not have, with a sentence on what to give."""

    @property
    @abstractmethod
    def machine(self) -> Machine:
        """The machine: inertias, shafts, contacts and torques."""

    @property
    def unreduced(self) -> Machine:
        """The machine in which contacts with driven bodies have not become moving bases."""
        return self.machine

    @property
    @abstractmethod
    def one_inertia(self) -> BrakedDriveline | None:
        """The driveline with the closed forms of one inertia; None if there is none."""

    @abstractmethod
    def parts(self) -> Mapping[str, Part]:
        """All parts by name, in order."""

    @abstractmethod
    def names(self) -> list[str]:
        """The names that ``replace`` takes."""

    def checks_itself(self, name: str) -> bool:  # noqa: ARG002 - of other systems
        """True for a name that ``replace`` may take although ``names`` does not list it."""
        return False

    @abstractmethod
    def quantities(self) -> dict[str, Quantity]:
        """Everything that can be swept, by name."""

    @abstractmethod
    def parameters(self) -> dict[str, float]:
        """All numbers by name [SI units]."""

    @abstractmethod
    def value(self, name: str) -> float:
        """Value of what has this name, as ``replace`` takes it [SI units]."""

    @abstractmethod
    def owner(self, name: str) -> str:
        """The name of the part that has a parameter."""

    @abstractmethod
    def hint(self, name: str, allowed: Collection[str]) -> str:
        """A sentence that helps with a name that is not among the allowed ones."""

    @abstractmethod
    def replace(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> Self:
        """A copy with other values, by name, in a mapping or as keywords."""

    @abstractmethod
    def machine_at(
        self, values: Mapping[str, float], initial: Sequence[float] | None = None
    ) -> Machine:
        """The machine with other values of what can be swept, also initial conditions.

        initial : angle [rad] and velocity [rad/s] at the start, of a system that holds none

        Raises ``InputError`` as ``replace``.
        """

    @abstractmethod
    def signals(self) -> dict[str, Signal]:
        """The signals by name."""

    @property
    @abstractmethod
    def groups(self) -> Groups:
        """The normalised groups; None where one is not defined."""

    @property
    def coords(self) -> dict[str, tuple[str, ...]]:
        """Names of the parts along each dimension of results: inertia, shaft, contact.

        Without the dimensions that ``view`` leaves out.
        """
        along = self.machine.parts_along
        return {
            dim: tuple(one.name for one in along[dim])
            for dim in ("inertia", "shaft", "contact")
            if dim not in self.view.single
        }

    @property
    @abstractmethod
    def initial_conditions(self) -> tuple[str, ...]:
        """Names of the initial angles and speeds that can be swept."""

    @abstractmethod
    def summary(self, swept: Collection[str] = ()) -> str:
        """The system in one line, without the groups that the ``swept`` parameters change."""

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """The system as plain tables, as a study file holds them."""

    def own_name(self, name: str) -> str:
        """The name in this system of what ``machine`` calls ``name``."""
        return name

    @property
    def period(self) -> float | None:
        """The common period of all signals [s]; None if there is none, 0 if no signal varies.

        Two signals have a common period if the ratio of their frequencies is a fraction with a
        denominator of at most 64.
        """
        found = [one.frequencies() for one in self.signals().values()]
        known = [one for one in found if one is not None]
        return common_period(sum(known, ()) if len(known) == len(found) else None)

    @property
    def autonomous(self) -> bool:
        """True if no signal varies in time; samples do not count."""
        return not any(one.varies for one in self.signals().values())

    def check_times(self, first: float, last: float) -> None:
        """Check that all signals are known in a run from ``first`` to ``last`` [s].

        Raises ``InputError``, which names the signal and the time.
        """
        check_known(self.signals(), first, last)


@contextmanager
def own_names(system: Any) -> Iterator[None]:
    """Inside, errors about the machine of a system have the names of the system."""
    try:
        yield
    except InputError as error:
        if not isinstance(system, System):  # which the error may be about
            raise
        raise error.renamed(system.own_name) from None
