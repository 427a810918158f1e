"""Names of a driveline in errors about its machine."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from wedgebrake.errors import InputError
from wedgebrake.model.actuation import Actuation
from wedgebrake.model.system import BrakedDriveline

# Names of the machine of a driveline, as regular expressions, and those of the driveline.
_OF_DRIVELINE = (
    (r"torque\.signal\b", "excitation"),
    (r"brake\.base_speed\b", "driveline.drive_speed"),
    (rf"brake\.(?={'|'.join(Actuation.model_fields)}\b)", "actuation."),
)


@contextmanager
def named_as_driveline(system: Any) -> Iterator[None]:
    """Inside, errors about the machine of a driveline have the names of the driveline."""
    try:
        yield
    except InputError as error:
        if not isinstance(system, BrakedDriveline):
            raise
        text, name = str(error), error.name
        for pattern, own in _OF_DRIVELINE:
            text = re.sub(rf"(?<![\w.]){pattern}", own, text)
            name = name and re.sub(rf"^{pattern}", own, name)
        raise InputError(text, name=name, value=error.value, allowed=error.allowed) from None
