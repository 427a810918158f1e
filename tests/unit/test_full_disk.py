"""Full disks: a word and exit status 1, the old file as it was, and nothing beside it."""

from __future__ import annotations

from pathlib import Path

from disks import earlier, room
from wedgebrake.explorer.core.export import export
from wedgebrake.explorer.core.presets import START, preset

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"


def test_netcdf(run, tmp_path):
    command = ["simulate", PAPER, "--set", "periods=20", "--out", "r.nc"]
    assert run(*command)[0] == 0  # with its kernels compiled
    target = tmp_path / "r.nc"
    size = target.stat().st_size
    target.write_bytes(b"earlier")
    # Room for nothing, and for all but the end.
    for most in (0, size - 1):
        with room(most):
            status, _, message = run(*command)
        assert status == 1, (most, message)
        assert "error: --out r.nc: cannot be written" in message
        assert "Traceback" not in message
        assert earlier(tmp_path, "r.nc") == b"earlier"


def test_export_of_the_page():
    """A page is served on, also where no file can be written at all."""

    def content() -> bytes:
        return export(preset(START).state().edited(periods=40), "netcdf").content

    content()  # its kernels compiled
    with room(0):
        found = content()
    assert found[1:4] == b"HDF"
    assert len(found) > 10_000


def test_example_leaves_no_empty_file(run, tmp_path):
    with room(100):
        status, output, message = run("example", "paper", "--out", "mine.toml")
    assert (status, output) == (1, "")
    assert message.startswith("error: --out mine.toml: cannot be written")
    assert list(tmp_path.iterdir()) == []
