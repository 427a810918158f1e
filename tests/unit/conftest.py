"""What the tests of the command line share."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from disks import full_disk as full_disk
from printed import strict_json
from wedgebrake.cli.main import main


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """The command line in this process, in an empty folder: (status, output, messages)."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["wedgebrake", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            main()
        return (stop.value.code or 0, *capsys.readouterr())

    return call


@pytest.fixture
def answer(run):
    """The JSON that a command prints, one line and nothing else."""

    def call(*arguments: str | Path) -> dict:
        status, text, _ = run(*arguments, "--json")
        assert status == 0
        assert text.count("\n") == 1
        return strict_json(text)

    return call
