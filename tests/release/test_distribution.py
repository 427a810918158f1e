"""Wheel and sdist: what is in them, and that they install and run where there is no clone."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path
from urllib.request import urlopen

import pytest
from typer.main import get_command

import wedgebrake as wb
from wedgebrake.cli.commands import app

ROOT = Path(__file__).parents[2]
PROGRAMS = "Scripts" if os.name == "nt" else "bin"
VERSIONS = ("3.11", "3.12", "3.13")
# What an extra gives; and the command that says so where it is missing.
EXTRAS = {
    "netcdf": ("import h5netcdf", ["simulate", "paper.toml", "--out", "run.nc"]),
    "app": ("import wedgebrake.explorer.ui.server", ["app", "--no-browser"]),
    "cluster": ("import distributed", None),
}


def files_of_the_package() -> set[str]:
    package = ROOT / "src" / "wedgebrake"
    return {
        path.relative_to(ROOT / "src").as_posix()
        for path in package.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """A folder with the sdist of the clone, and the wheel that is built from it."""
    pytest.importorskip("hatchling", reason="needs hatchling, of the extra dev")
    folder = tmp_path_factory.mktemp("built")
    build(ROOT, "sdist", folder)
    with tarfile.open(next(folder.glob("*.tar.gz"))) as archive:
        # Early patches of Python 3.11 know no filters; the archive is our own.
        safe = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
        archive.extractall(folder, **safe)  # noqa: S202
    build(folder / f"wedgebrake-{wb.__version__}", "wheel", folder)
    return folder


def build(source: Path, target: str, folder: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", folder],
        cwd=source,
        check=True,
        capture_output=True,
        timeout=120,
    )


class TestContents:
    def test_wheel_holds_the_package_and_the_examples_and_no_more(self, built):
        examples = set()
        with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
            names = {name for name in wheel.namelist() if ".dist-info/" not in name}
            for path in [*(ROOT / "examples").glob("*.toml"), *(ROOT / "examples").glob("*.csv")]:
                examples.add(f"wedgebrake/examples/{path.name}")
                assert wheel.read(f"wedgebrake/examples/{path.name}") == path.read_bytes()
        assert names == files_of_the_package() | examples
        assert "wedgebrake/py.typed" in names

    def test_metadata(self, built):
        with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
            [about] = [name for name in wheel.namelist() if name.endswith("METADATA")]
            lines = wheel.read(about).decode().splitlines()
            [scripts] = [name for name in wheel.namelist() if name.endswith("entry_points.txt")]
            assert "wedgebrake = wedgebrake.cli:process_main" in wheel.read(scripts).decode()
            assert any(name.endswith("licenses/LICENSE") for name in wheel.namelist())
        assert f"Version: {wb.__version__}" in lines
        assert "License-Expression: BSD-3-Clause" in lines
        assert "Requires-Python: >=3.11" in lines
        for version in VERSIONS:
            assert f"Classifier: Programming Language :: Python :: {version}" in lines

    def test_sdist_holds_what_builds_and_tests_it(self, built):
        source = built / f"wedgebrake-{wb.__version__}"
        inside = {path.relative_to(source).as_posix() for path in source.rglob("*")}
        for name in ("pyproject.toml", "Makefile", "LICENSE", "README.md", "CHANGELOG.md"):
            assert name in inside
        tracked = subprocess.run(
            ["git", "ls-files", "src", "tests", "examples", "docs", "benchmarks"],
            cwd=ROOT,
            capture_output=True,
            text=True,
        )
        if tracked.returncode:
            pytest.skip("not a clone: nothing to compare with")
        there = {name for name in tracked.stdout.splitlines() if (ROOT / name).is_file()}
        assert there
        assert there <= inside


def interpreters() -> list[str]:
    """A Python of each version that is supported and found."""
    found = {f"{sys.version_info[0]}.{sys.version_info[1]}": sys.executable}
    for version in VERSIONS:
        named = shutil.which(f"python{version}")
        here = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"))
        if version not in found and (named or here):
            found[version] = str(here[-1]) if here else str(named)
    return [found[version] for version in sorted(found)]


class Place:
    """A virtual environment outside the clone, with nothing but the wheel and its extras.

    lowest : with the lowest versions that the wheel allows, not the newest
    """

    def __init__(
        self, folder: Path, python: str, wheel: Path, extras: str = "", *, lowest: bool = False
    ) -> None:
        self.folder, self.programs = folder, folder / "venv" / PROGRAMS
        subprocess.run([python, "-m", "venv", folder / "venv"], check=True)
        wanted = f"{wheel}[{extras}]" if extras else str(wheel)
        if not lowest:
            self.call("python", "-m", "pip", "install", "--quiet", wanted, check=True)
            return
        pytest.importorskip("uv", reason="needs uv, of the extra dev")
        # Of what has no wheel for this Python the lowest that has one.
        how = ["--resolution", "lowest-direct", "--only-binary", ":all:", "--quiet"]
        place = ["--python", str(self.programs / "python")]
        subprocess.run(
            [sys.executable, "-m", "uv", "pip", "install", *how, *place, wanted], check=True
        )

    @property
    def environment(self) -> dict[str, str]:
        """The variables of this process without those that show the clone."""
        hidden = ("PYTHONPATH", "NUMBA_CACHE_DIR", "VIRTUAL_ENV")
        shown = {name: value for name, value in os.environ.items() if name not in hidden}
        return shown | {"NUMBA_CACHE_DIR": str(self.folder / "cache")}

    def call(self, program: str, *arguments: str, check: bool = False):
        """A program of the environment, run in its folder with nothing of the clone in sight."""
        return subprocess.run(
            [self.programs / program, *arguments],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=check,
            timeout=600,
        )


@pytest.mark.slow
@pytest.mark.parametrize("python", interpreters(), ids=lambda path: Path(path).name)
def test_the_wheel_runs_the_demo_without_the_clone(python, built, tmp_path):
    place = Place(tmp_path, python, next(built.glob("*.whl")))
    version = place.call("wedgebrake", "--version")
    assert version.stdout == f"wedgebrake {wb.__version__}\n"
    place.call("wedgebrake", "example", "paper", "--out", "paper.toml", check=True)
    place.call("wedgebrake", "example", "sweep", "--out", "sweep.toml", check=True)
    shown = place.call("wedgebrake", "simulate", "paper.toml", "--plot", "run.png", check=True)
    assert "Bidirectional stick-slip vibration" in shown.stdout
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    place.call("wedgebrake", "sweep", "sweep.toml", "--plot", "eta.png", check=True)
    assert (tmp_path / "eta.png").stat().st_size > 10_000
    listed = place.call("wedgebrake", "paper", check=True)
    assert "fig8" in listed.stdout
    warned = place.call("python", "-W", "error", "-c", "import wedgebrake as wb; wb.paper.system()")
    assert (warned.returncode, warned.stderr) == (0, "")
    doctor = place.call("wedgebrake", "doctor", "--json")
    report = json.loads(doctor.stdout)
    assert (doctor.returncode, report["advice"]) == (0, [])
    assert report["folder"].startswith(str(tmp_path))
    assert not any(extra["complete"] for extra in report["extras"].values())


@pytest.mark.slow
@pytest.mark.parametrize("extra", EXTRAS)
def test_an_extra_installs_alone(extra, built, tmp_path):
    program, _ = EXTRAS[extra]
    place = Place(tmp_path, sys.executable, next(built.glob("*.whl")), extra)
    place.call("python", "-W", "error::ImportWarning", "-c", program, check=True)
    place.call("wedgebrake", "example", "paper", "--out", "paper.toml", check=True)
    report = json.loads(place.call("wedgebrake", "doctor", "--json", check=True).stdout)
    assert [name for name, one in report["extras"].items() if one["complete"]] == [extra]
    for other, (_, command) in EXTRAS.items():
        if other != extra and command is not None:
            refused = place.call("wedgebrake", *command)
            assert refused.returncode == 2
            assert f"Install the extra: pip install 'wedgebrake[{other}]'" in refused.stderr
    if extra == "netcdf":
        place.call("wedgebrake", "simulate", "paper.toml", "--out", "run.nc", check=True)
        assert (tmp_path / "run.nc").stat().st_size > 10_000


@pytest.mark.slow
def test_every_command_runs_with_the_lowest_versions(built, tmp_path):
    place = Place(
        tmp_path, sys.executable, next(built.glob("*.whl")), ",".join(EXTRAS), lowest=True
    )

    def works(*arguments: str) -> str:
        done = place.call("wedgebrake", *arguments)
        assert done.returncode == 0, (arguments, done.stdout, done.stderr)
        return done.stdout

    for command in get_command(app).commands:
        assert works(command, "--help").startswith(f"Usage: wedgebrake {command}")
    refused = place.call("wedgebrake", "simulate", "--plto")
    assert (refused.returncode, "--plot" in refused.stderr) == (2, True)
    assert works("--version") == f"wedgebrake {wb.__version__}\n"
    assert json.loads(works("schema"))
    works("example", "paper", "--out", "paper.toml")
    works("stability", "paper.toml")
    for example in ("belt", "clutch"):
        works("example", example, "--out", f"{example}.toml")
        works("stability", f"{example}.toml")
    works("simulate", "paper.toml", "--out", "run.nc", "--plot", "run.png")
    sweep = ["sweep", "paper.toml", "--over", "eta=-60:12:8", "--store", "run.zarr"]
    works(*sweep, "--plot", "eta.pdf")
    works(*sweep, "--resume", "--out", "eta.nc")
    opened = (
        "import xarray; print(xarray.open_dataset('run.zarr', engine='wedgebrake').sizes['eta'])"
    )
    assert place.call("python", "-c", opened).stdout == "8\n"
    works("continue", "paper.toml", "--over", "eta=-10:-18", "--points", "20", "--out", "o.nc")
    works("paper", "fig2", "--out", "figures")
    on_a_cluster = """
import wedgebrake as wb
from distributed import Client
with Client(processes=False, dashboard_address=None) as client:
    print(wb.sweep(wb.paper.system(), eta=[-24.0, 0.0], client=client).sizes["eta"])
"""
    assert place.call("python", "-c", on_a_cluster).stdout == "2\n"
    report = json.loads(works("doctor", "--json"))
    assert (report["advice"], {one["complete"] for one in report["extras"].values()}) == (
        [],
        {True},
    )


@pytest.mark.slow
def test_the_explorer_runs_with_the_lowest_versions(built, tmp_path):
    place = Place(tmp_path, sys.executable, next(built.glob("*.whl")), "app", lowest=True)
    with subprocess.Popen(
        [place.programs / "wedgebrake", "app", "--port", "0", "--no-browser"],
        cwd=tmp_path, env=place.environment, stderr=subprocess.PIPE, text=True,
    ) as served:  # fmt: skip
        try:
            [url] = re.findall(r"http://\S+", served.stderr.readline())
            with urlopen(url) as page:  # noqa: S310 - our own page
                assert "wedgebrake explorer" in page.read().decode()
        finally:
            served.terminate()
        assert served.wait(60) == 0, served.stderr.read()
