"""``wedgebrake doctor``: what is installed and compiled, and what is wrong, told from outside."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

import wedgebrake as wb
from wedgebrake.cli import doctor, doctor_packages
from wedgebrake.cli.doctor_packages import EXTRAS, packages
from wedgebrake.sweeps.executor import processors

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PROGRAM = Path(sys.executable).with_name("wedgebrake")


def call(*arguments: str, **environment: str) -> tuple[int, str, str]:
    """The command in a process of its own: (status, output, messages)."""
    done = subprocess.run(
        [PROGRAM, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stdout, done.stderr


def told(*arguments: str, **environment: str) -> tuple[int, dict]:
    """(status, what --json says): one line and nothing else."""
    status, output, messages = call("doctor", "--json", *arguments, **environment)
    assert messages == ""
    assert output.count("\n") == 1
    return status, json.loads(output)


@pytest.fixture(scope="module")
def well(tmp_path_factory) -> tuple[int, dict]:
    """What it says where nothing is wrong, with an empty cache."""
    return told(NUMBA_CACHE_DIR=str(tmp_path_factory.mktemp("cache")))


class TestWell:
    def test_exit_status_and_advice(self, well):
        status, report = well
        assert (status, report["healthy"], report["advice"]) == (0, True, [])

    def test_versions_are_those_installed(self, well):
        _, report = well
        assert report["wedgebrake"] == wb.__version__
        assert Path(report["executable"]).parent == PROGRAM.parent
        wanted = {
            line.partition(">")[0]: line.partition(">=")[2] for line in PROJECT["dependencies"]
        }
        assert {one["name"]: one["needed"] for one in report["packages"]} == wanted
        for one in report["packages"]:
            assert one["installed"] == version(one["name"])

    def test_extras_are_those_that_users_choose(self, well):
        _, report = well
        declared = PROJECT["optional-dependencies"]
        assert set(report["extras"]) == set(EXTRAS) == set(declared) - {"dev", "bench", "docs"}
        for name, extra in report["extras"].items():
            assert [one["name"] for one in extra["packages"]] == sorted(
                line.partition(">")[0] for line in declared[name]
            )
            assert extra["complete"] == all(one["installed"] for one in extra["packages"])

    def test_threads_are_those_of_a_sweep(self, well):
        _, report = well
        assert report["processors"] == os.cpu_count()
        assert report["threads"] == processors()

    def test_text_says_the_same(self, well):
        _, report = well
        text = doctor.text(report)
        for one in report["packages"]:
            assert f"\n  {one['name']:14}{one['installed']}\n" in text
        for word in (f"wedgebrake {wb.__version__}", report["executable"], "Extra cluster", "0 of"):
            assert word in text


class TestKernels:
    def test_those_called_are_compiled_and_no_others(self, tmp_path):
        """Numba's own statistics say which were; the index files must say the same."""
        program = (
            "from wedgebrake.solvers.event_driven import root_exclusion\n"
            "root_exclusion.safe_step(1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 10.0)\n"
            "compiled = [n for n in dir(root_exclusion)"
            " if getattr(getattr(root_exclusion, n), 'signatures', None)]\n"
            "print(*(f'solvers.event_driven.root_exclusion.{name}' for name in compiled))\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        )
        _, report = told(NUMBA_CACHE_DIR=str(tmp_path))
        assert "solvers.event_driven.root_exclusion.safe_step" in report["kernels"]["compiled"]
        assert sorted(done.stdout.split()) == report["kernels"]["compiled"]
        assert report["kernels"]["stale"] == []
        assert report["kernels"]["all"] > 50
        assert Path(report["cache"]["folder"]) == tmp_path

    def test_what_other_sources_left_is_stale(self, tmp_path):
        package = tmp_path / "src" / "wedgebrake"
        shutil.copytree(Path(wb.__file__).parent, package)
        program = (
            f"import sys; sys.path.insert(0, {str(package.parent)!r})\n"
            "from wedgebrake.solvers.event_driven import root_exclusion\n"
            "root_exclusion.safe_step(1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 10.0)\n"
            "from wedgebrake.cli.doctor_kernels import kernels\n"
            "seen = kernels()\n"
            "name = 'solvers.event_driven.root_exclusion.safe_step'\n"
            "print(name in seen.compiled, name in seen.stale)\n"
        )
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        command = [sys.executable, "-c", program]

        def seen() -> str:
            return subprocess.run(
                command, env=environment, capture_output=True, text=True, check=True
            ).stdout.strip()

        assert seen() == "True False"
        (package / "dynamics" / "linear_flow.py").touch()
        # Asked before anything is compiled anew.
        command[2] = program.replace(
            "root_exclusion.safe_step(1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 10.0)\n", ""
        )
        assert seen() == "False True"

    def test_a_damaged_index_is_not_counted(self, tmp_path):
        told(NUMBA_CACHE_DIR=str(tmp_path))
        (folder,) = tmp_path.glob("event_driven_*")
        (folder / "root_exclusion.safe_step-20.py311.nbi").write_bytes(b"no pickle")
        status, report = told(NUMBA_CACHE_DIR=str(tmp_path))
        assert (status, report["kernels"]["compiled"]) == (0, [])
        assert report["kernels"]["stale"] == ["solvers.event_driven.root_exclusion.safe_step"]

    def test_every_kernel_that_numba_knows_is_known(self):
        """Of all modules of the package, imported one by one."""
        program = (
            "import importlib, pkgutil, wedgebrake\n"
            "from wedgebrake.cli.doctor_kernels import kernels\n"
            "known, seen = set(kernels().names), set()\n"
            "for area in ('dynamics', 'solvers', 'analysis', 'orbits'):\n"
            "    package = importlib.import_module(f'wedgebrake.{area}')\n"
            "    for one in pkgutil.walk_packages(package.__path__, f'wedgebrake.{area}.'):\n"
            "        module = importlib.import_module(one.name)\n"
            "        for kernel in vars(module).values():\n"
            "            function = getattr(kernel, 'py_func', None)\n"
            "            if function is not None and function.__module__ == one.name:\n"
            "                seen.add(f\"{one.name.partition('.')[2]}.{function.__name__}\")\n"
            "assert seen, 'none found'\n"
            "assert seen <= known, seen - known\n"
        )
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


class TestWrong:
    def test_a_cache_that_cannot_be_written(self):
        status, report = told(NUMBA_CACHE_DIR="/dev/null/cache")
        assert (status, report["healthy"]) == (1, False)
        [advice] = report["advice"]
        assert "NUMBA_CACHE_DIR = /dev/null/cache cannot be written" in advice

    def test_no_place_for_a_cache(self):
        nowhere = {
            "NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator",
            "NUMBA_CACHE_DIR": "/dev/null/cache",
        }
        for command in (["doctor"], ["simulate", str(ROOT / "examples" / "paper.toml")]):
            status, text, messages = call(*command, **nowhere)
            assert status == 1
            assert "Set NUMBA_CACHE_DIR" in " ".join((text + messages).split())
            assert "Traceback" not in messages

    def test_compilation_switched_off(self):
        status, report = told(NUMBA_DISABLE_JIT="1")
        assert status == 1
        assert any("Unset NUMBA_DISABLE_JIT" in line for line in report["advice"])

    def test_a_package_that_is_broken(self, tmp_path):
        """A module of that name that fails as it is imported comes first on the path."""
        (tmp_path / "h5py.py").write_text("raise ImportError('libhdf5.so: no such file')\n")
        status, report = told(PYTHONPATH=str(tmp_path))
        assert status == 1
        [advice] = report["advice"]
        assert "h5py of the extra netcdf cannot be imported" in advice
        assert "libhdf5.so: no such file" in advice
        assert (
            f"{report['executable']} -m pip install --force-reinstall 'wedgebrake[netcdf]'"
            in advice
        )
        assert report["extras"]["netcdf"]["complete"] is False

    def test_numba_that_is_broken(self, tmp_path):
        (tmp_path / "numba.py").write_text("raise OSError('libLLVM.so: no such file')\n")
        status, text, messages = call("doctor", PYTHONPATH=str(tmp_path))
        assert (status, messages) == (1, "")
        assert "numba cannot be imported (OSError: libLLVM.so: no such file)." in " ".join(
            text.split()
        )
        assert "Traceback" not in text


class TestMissing:
    @pytest.fixture
    def without(self, monkeypatch):
        """As if some packages were not installed."""

        def remove(*names: str) -> None:
            def installed(name: str) -> str:
                if name in names:
                    raise PackageNotFoundError(name)
                return version(name)

            monkeypatch.setattr(doctor_packages, "version", installed)

        return remove

    def test_an_extra_that_nobody_installed_is_no_fault(self, without):
        without("panel", "bokeh")
        report = doctor.examine()
        assert report["healthy"]
        assert not report["extras"]["app"]["complete"]
        assert "Extra app, not complete" in doctor.text(report)

    def test_half_an_extra_is_a_fault(self, without):
        without("bokeh")
        report = doctor.examine()
        [advice] = report["advice"]
        assert advice.startswith("bokeh of the extra app is not installed.")
        assert advice.endswith("pip install 'wedgebrake[app]'")

    def test_a_need_is_a_fault(self, without):
        without("rich")
        report = doctor.examine()
        [advice] = report["advice"]
        assert advice.startswith("rich is not installed.")
        assert advice.endswith("pip install 'rich>=13'")
        assert not report["healthy"]

    @pytest.mark.parametrize(
        ("installed", "old"),
        [("13.0.0", False), ("12.9.9", True), ("100.1", False), ("13.1rc1", False)],
    )
    def test_versions_are_compared_as_numbers(self, installed, old, monkeypatch):
        monkeypatch.setattr(
            doctor_packages, "version", lambda name: installed if name == "rich" else version(name)
        )
        [rich] = [one for one in packages() if one.name == "rich"]
        assert ("too old" in rich.problem) == old

    def test_not_installed_at_all(self, monkeypatch):
        def unknown(name: str) -> list[str]:
            raise PackageNotFoundError(name)

        monkeypatch.setattr(doctor_packages, "requires", unknown)
        with pytest.raises(wb.InputError, match=r"imported from a folder.*pip install"):
            doctor.examine()
