"""The systems over one or two parameters, as the kernels take them."""

from __future__ import annotations

from typing import Any

from wedgebrake.model.system import BrakedDriveline

# Neighbours in a parameter are asked for again and again by differences and Newton's method.
_REMEMBERED = 16


class Family:
    """A system of which some parameters vary.

    names  : their names, SI parameters or groups; none for the system alone
    scales : (n,) a change of each that is no small one
    method : "exact" or "smooth"
    rtol   : tolerance of "smooth"
    """

    def __init__(
        self,
        system: BrakedDriveline,
        names: tuple[str, ...] = (),
        scales: tuple[float, ...] = (),
        *,
        method: str,
        rtol: float,
    ) -> None:
        self.base, self.names, self.scales = system, names, scales
        self.method, self.rtol = method, rtol
        self._problems: dict[tuple[float, ...], Any] = {}

    def system(self, values: tuple[float, ...]) -> BrakedDriveline:
        """The system with these values; raises ``InputError`` where there is none."""
        if not values:
            return self.base
        return self.base.replace(**dict(zip(self.names, map(float, values), strict=True)))

    def problem(self, values: tuple[float, ...]) -> Any:
        """The arguments of the kernels; raises ``InputError`` where there is no such system."""
        if values not in self._problems:
            if len(self._problems) >= _REMEMBERED:
                del self._problems[next(iter(self._problems))]
            self._problems[values] = self._assemble(self.system(values))
        return self._problems[values]

    def _assemble(self, system: BrakedDriveline) -> Any:
        if self.method == "exact":
            from wedgebrake.solvers.event_driven.solve import problem

            return problem(system)
        from wedgebrake.solvers.smooth.assemble import problem as smooth_problem

        return smooth_problem(system, self.rtol, any_law=True)
