"""States of the page for tests."""

from __future__ import annotations

import wedgebrake as wb
from wedgebrake.explorer.core.state import PageState
from wedgebrake.model.studies.study import RunSettings, Study


def new_state(system: wb.BrakedDriveline) -> PageState:
    """The state with a system and the default run settings."""
    return PageState.of(Study(system, RunSettings()))
