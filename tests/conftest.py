"""Common to all tests; its presence puts tests/ on the import path for the helper modules."""

import os

import pytest

# Before NumPy is imported: threads for matrices of ten rows take longer than the matrices, and
# most of all where several processes test.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what is marked slow, unless the command line chooses by marker."""
    if config.getoption("markexpr"):
        return
    for item in items:
        if "slow" in item.keywords:
            item.add_marker(pytest.mark.skip(reason="slow: run with -m slow"))
