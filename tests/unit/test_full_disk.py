"""Full disks: a word and exit status 1, the old file as it was, and nothing beside it."""

from __future__ import annotations

from pathlib import Path

from disks import earlier, with_room

EXAMPLES = Path(__file__).parents[2] / "examples"
PAPER = EXAMPLES / "paper.toml"


def test_netcdf(run, tmp_path):
    command = ["simulate", PAPER, "--set", "periods=20", "--out", "r.nc"]
    assert run(*command)[0] == 0  # with its kernels compiled
    target = tmp_path / "r.nc"
    size = target.stat().st_size
    target.write_bytes(b"earlier")
    # Room for nothing, and for all but the end.
    for room in (0, size - 1):
        done = with_room(room, "-m", "wedgebrake", *command, cwd=tmp_path)
        assert done.returncode == 1, (room, done.stderr)
        assert "error: --out r.nc: cannot be written" in done.stderr
        assert "Traceback" not in done.stderr
        assert earlier(tmp_path, "r.nc") == b"earlier"


def test_export_of_the_page(tmp_path):
    """A page is served on, also where no file can be written at all."""
    program = (
        "from wedgebrake.explorer.core.export import export\n"
        "from wedgebrake.explorer.core.presets import START, preset\n"
        "content = export(preset(START).state().edited(periods=40), 'netcdf').content\n"
        "print(content[1:4].decode(), len(content))\n"
    )
    exec(program)  # noqa: S102 - its kernels compiled
    done = with_room(0, "-c", program, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    kind, size = done.stdout.split()
    assert (kind, int(size) > 10_000) == ("HDF", True)


def test_example_leaves_no_empty_file(tmp_path):
    order = ("-m", "wedgebrake", "example", "paper", "--out", "mine.toml")
    done = with_room(100, *order, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("error: --out mine.toml: cannot be written")
    assert list(tmp_path.iterdir()) == []
