"""The command line in this process, as in the unit tests."""

from unit.conftest import run

__all__ = ["run"]
