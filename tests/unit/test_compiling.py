"""The disk cache of the kernels: shared by processes, and never stale."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import wedgebrake

PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from wedgebrake.solvers.event_driven import root_exclusion
value = root_exclusion.safe_step(1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 10.0)
print(value, sum(root_exclusion.safe_step.stats.cache_hits.values()))
"""


def run(root: Path, cache: Path) -> tuple[float, int]:
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(root)],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
    )
    value, hits = result.stdout.split()
    return float(value), int(hits)


def test_a_change_in_a_called_file_is_noticed(tmp_path):
    """Numba alone watches only the file of the kernel itself."""
    package = tmp_path / "src" / "wedgebrake"
    shutil.copytree(Path(wedgebrake.__file__).parent, package)
    first = run(package.parent, tmp_path / "cache")
    assert first == (1.0, 0)
    assert run(package.parent, tmp_path / "cache") == (1.0, 1)
    other = package / "dynamics" / "linear_flow.py"
    other.write_text(other.read_text() + "\n# changed\n")
    assert run(package.parent, tmp_path / "cache") == (1.0, 0)
