"""``wedgebrake doctor``: what is installed and compiled, and what is wrong."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numba
import pytest

import wedgebrake as wb
from printed import strict_json, unwrapped
from wedgebrake.cli import doctor
from wedgebrake.sweeps.executor import processors

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PROGRAM = Path(sys.executable).with_name("wedgebrake")


@pytest.fixture
def told(run):
    """(status, what --json says): one line and nothing else."""

    def call() -> tuple[int, dict]:
        status, output, messages = run("doctor", "--json")
        assert (messages, output.count("\n")) == ("", 1)
        return status, strict_json(output)

    return call


def call(*arguments: object, **environment: str) -> tuple[int, str, str]:
    """The command in a process of its own: (status, output, messages)."""
    done = subprocess.run(
        [PROGRAM, *arguments], env={**os.environ, **environment}, capture_output=True, text=True
    )
    return done.returncode, done.stdout, done.stderr


def test_where_nothing_is_wrong(told, run):
    status, report = told()
    assert (status, report["healthy"], report["advice"]) == (0, True, [])
    assert report["wedgebrake"] == wb.__version__
    assert report["executable"] == sys.executable
    lowest = (line.split(",")[0] for line in PROJECT["dependencies"])
    wanted = {line.partition(">")[0]: line.partition(">=")[2] for line in lowest}
    assert {one["name"]: one["needed"] for one in report["packages"]} == wanted
    for one in report["packages"]:
        assert one["installed"] == version(one["name"])
    declared = PROJECT["optional-dependencies"]
    assert set(report["extras"]) == set(doctor.EXTRAS) == set(declared) - {"dev", "bench", "docs"}
    for name, extra in report["extras"].items():
        assert [one["name"] for one in extra["packages"]] == sorted(
            line.partition(">")[0] for line in declared[name]
        )
        assert extra["complete"] == all(one["installed"] for one in extra["packages"])
    assert report["processors"] == os.cpu_count()
    assert report["threads"] == processors()
    text = run("doctor")[1]
    for one in report["packages"]:
        assert f"\n  {one['name']:14}{one['installed']}\n" in text


def test_the_folder_of_the_cache(told, tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    _, report = told()
    assert Path(report["cache"]["folder"]).parent == tmp_path
    assert report["cache"]["problem"] == ""


class TestWrong:
    def test_a_cache_that_cannot_be_written(self, told, monkeypatch):
        monkeypatch.setenv("NUMBA_CACHE_DIR", "/dev/null/cache")
        monkeypatch.setattr(numba.config, "CACHE_DIR", "/dev/null/cache")
        status, report = told()
        assert (status, report["healthy"]) == (1, False)
        [advice] = report["advice"]
        assert "NUMBA_CACHE_DIR = /dev/null/cache" in advice

    def test_no_place_for_a_cache(self):
        """Kernels are compiled without one, and the message tells the way out once."""
        nowhere = {
            "NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator",
            "NUMBA_CACHE_DIR": "/dev/null/cache",
        }
        status, text, messages = call("doctor", **nowhere)
        assert status == 1
        assert "Set NUMBA_CACHE_DIR" in unwrapped(text + messages)
        status, _, messages = call("stability", ROOT / "examples/paper.toml", **nowhere)
        assert status == 0
        status, _, messages = call("simulate", ROOT / "examples/paper.toml", **nowhere)
        assert status == 0
        assert messages.count("Set NUMBA_CACHE_DIR") == 1
        assert "Traceback" not in messages

    def test_compilation_switched_off(self):
        """Kernels compile nevertheless, of any law, and the numbers are the same."""
        program = """
import wedgebrake as wb
own = wb.CustomFriction(law=lambda v: 0.3 * v / (1.0 + abs(v)), width=0.01, kinetic=0.3)
for system in (wb.paper.system(), wb.paper.system().replace(friction=own)):
    print(wb.simulate(system, duration=0.05).attrs["final_angle"])
"""
        found = [
            subprocess.run(
                [sys.executable, "-c", program], env={**os.environ, "NUMBA_DISABLE_JIT": switch},
                capture_output=True, text=True, check=True,
            ).stdout
            for switch in ("0", "1")
        ]  # fmt: skip
        assert found[0] == found[1]
        assert found[0].count("\n") == 2

    def test_a_package_that_is_broken(self, told, monkeypatch):
        def broken(name: str) -> None:
            if name == "h5py":
                raise ImportError("libhdf5.so: no such file")

        monkeypatch.setattr(doctor, "import_module", broken)
        status, report = told()
        assert status == 1
        [advice] = report["advice"]
        assert advice.startswith("h5py of the extra netcdf")
        assert "libhdf5.so: no such file" in advice
        assert "pip install --force-reinstall 'wedgebrake[netcdf]'" in advice
        assert report["extras"]["netcdf"]["complete"] is False

    def test_numba_that_is_broken(self, tmp_path):
        (tmp_path / "numba.py").write_text("raise OSError('libLLVM.so: no such file')\n")
        path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
        status, text, messages = call("doctor", PYTHONPATH=path)
        assert (status, messages) == (1, "")
        assert "OSError: libLLVM.so: no such file" in unwrapped(text)


class TestMissing:
    @pytest.fixture
    def without(self, monkeypatch):
        """As if some packages were not installed."""

        def remove(*names: str) -> None:
            def installed(name: str) -> str:
                if name in names:
                    raise PackageNotFoundError(name)
                return version(name)

            monkeypatch.setattr(doctor, "version", installed)

        return remove

    def test_an_extra_that_nobody_installed_is_no_fault(self, without):
        without("panel", "bokeh")
        report = doctor.examine()
        assert report["healthy"]
        assert not report["extras"]["app"]["complete"]

    @pytest.mark.parametrize(
        ("name", "wanted"), [("bokeh", "wedgebrake[app]"), ("rich", "rich>=13")]
    )
    def test_half_an_extra_or_a_need_is_a_fault(self, name, wanted, without):
        without(name)
        report = doctor.examine()
        [advice] = report["advice"]
        assert advice.startswith(name)
        assert advice.endswith(f"pip install '{wanted}'")
        assert not report["healthy"]

    @pytest.mark.parametrize(
        ("installed", "old"),
        [("13.0.0", False), ("12.9.9", True), ("100.1", False), ("13.1rc1", False)],
    )
    def test_versions_are_compared_as_numbers(self, installed, old, monkeypatch):
        monkeypatch.setattr(
            doctor, "version", lambda name: installed if name == "rich" else version(name)
        )
        [rich] = [one for one in doctor.packages() if one["name"] == "rich"]
        assert bool(rich["problem"]) == old

    def test_not_installed_at_all(self, monkeypatch):
        def unknown(name: str) -> list[str]:
            raise PackageNotFoundError(name)

        monkeypatch.setattr(doctor, "requires", unknown)
        with pytest.raises(wb.InputError, match="pip install"):
            doctor.examine()
