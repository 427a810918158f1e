"""What is loaded when: nothing by ``import wedgebrake``, and no warning by anything."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import windows

import wedgebrake as wb
from wedgebrake.analysis.responses.spectrum import window_weights
from wedgebrake.figures.matplotlib import style
from wedgebrake.figures.matplotlib.save import image

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
HOMES = sorted(
    {getattr(getattr(wb, name), "__module__", "wedgebrake.paper") for name in wb.__all__}
)
AREAS = sorted(path.parent.name for path in Path(wb.__file__).parent.glob("*/__init__.py"))


def python(*arguments: str) -> str:
    """What Python prints; an error or a word on standard error is a failure."""
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=300)
    said = re.sub(r"^Compiling .*\n", "", done.stderr, flags=re.M)  # where the cache is empty
    assert (done.returncode, said) == (0, "")
    return done.stdout


@pytest.mark.parametrize("every", [6, pytest.param(1, marks=pytest.mark.slow)])
def test_no_warning_as_the_package_and_each_module_is_imported(every):
    """Public modules each on its own path, so that none leans on what another one loaded.

    Importing a submodule makes it an attribute of the package: none hides a public name.
    """
    code = (
        "import importlib, pkgutil, sys, types\n"
        "import wedgebrake as wb\n"
        "for name in wb.__all__: getattr(wb, name)\n"
        "print(len(dir(wb)))\n"
        "def forget():\n"
        "    for old in [one for one in sys.modules if one.startswith('wedgebrake')]:\n"
        "        del sys.modules[old]\n"
        "for name in sys.argv[1:]:\n"
        "    forget()\n"
        "    importlib.import_module(name)\n"
        "forget()\n"
        "import wedgebrake as wb\n"
        "for one in pkgutil.walk_packages(wb.__path__, 'wedgebrake.'):\n"
        "    if not one.name.endswith('__main__'): importlib.import_module(one.name)\n"
        "print(*(n for n in wb.__all__ if isinstance(getattr(wb, n), types.ModuleType)))\n"
    )
    areas = [f"wedgebrake.{area}" for area in AREAS]
    printed = python("-W", "error", "-c", code, *HOMES[::every], *areas).splitlines()
    assert printed == [str(len(wb.__all__)), "paper testing"]


def test_the_package_loads_nothing_else():
    code = (
        "import sys; before = set(sys.modules)\n"
        "import wedgebrake\n"
        "import json; print(json.dumps(sorted(set(sys.modules) - before)))\n"
    )
    loaded = {name.partition(".")[0] for name in json.loads(python("-c", code))}
    assert loaded - set(sys.stdlib_module_names) == {"lazy_loader", "wedgebrake"}


def test_a_run_with_a_picture_warns_of_nothing_and_loads_no_more_than_it_needs(tmp_path):
    code = (
        "import sys\n"
        "from wedgebrake.cli.main import main\n"
        f"sys.argv = ['wedgebrake', 'simulate', {str(PAPER)!r}, '--set', 'periods=20',\n"
        f"            '--plot', {str(tmp_path / 'run.png')!r}]\n"
        "try:\n"
        "    main()\n"
        "except SystemExit as stop:\n"
        "    assert not stop.code\n"
        "heavy = ['scipy.signal', 'scipy.stats', 'scipy.optimize', 'scipy.integrate', 'zarr',\n"
        "         'matplotlib.pyplot', 'dask.array', 'distributed', 'panel', 'bokeh', 'h5netcdf',\n"
        "         'rich']\n"
        "print([name for name in heavy if name in sys.modules])\n"
    )
    assert python("-W", "error", "-c", code).splitlines()[-1] == "[]"


class TestShortCuts:
    """What makes the start quick gives what the slow way gives, bit for bit."""

    @pytest.mark.parametrize("n", [2, 3, 101, 4096])
    def test_the_usual_window_is_scipys(self, n):
        ours = window_weights("hann", n)
        assert ours.tobytes() == windows.get_window("hann", n, fftbins=True).tobytes()

    @pytest.mark.parametrize("what", ["response", "map"])
    def test_a_picture_is_that_of_savefig(self, what, tmp_path):
        system = wb.paper.system()
        response = wb.simulate(system, periods=20)
        eta, alpha = np.linspace(-2.0, 1.0, 30), np.linspace(1.05, 2.0, 20)
        shown = {
            "response": lambda: response,
            "map": lambda: wb.stability_map(system, eta=eta, alpha=alpha),
        }[what]()
        figure, other = wb.plot(shown), wb.plot(shown)
        canvas, dpi = figure.canvas, figure.dpi
        ours = image(figure, "png", width=800)
        path = tmp_path / "savefig.png"
        with style.use():
            other.savefig(path, dpi=800 / other.get_figwidth() * (1.0 + 1e-9), metadata={})
        assert ours == path.read_bytes()
        assert (figure.canvas, figure.dpi) == (canvas, dpi)


def test_nothing_is_written_where_the_cache_is_named(tmp_path):
    """Beside the cache itself, a start leaves no file behind."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    subprocess.run(
        [sys.executable, "-c", "import wedgebrake as wb; wb.stability(wb.paper.system())"],
        cwd=tmp_path,
        env=environment,
        check=True,
    )
    assert list(tmp_path.iterdir()) == []
