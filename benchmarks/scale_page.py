"""docs/scale.md: what was measured, and what follows for a map of 10^4 x 10^4 points."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

TEMPLATE = Path(__file__).with_name("templates") / "scale.md"
SIDE = 10_000
# From these sizes on, what does not grow with them is little.
LARGE = {"periods": 500, "points": 1000}
LAW_WORDS = {"coulomb": "Coulomb, exact", "smoothed": "smoothed, rtol 1e-9"}


class Chunk(NamedTuple):
    """What a chunk of the great map costs.

    points, chunks : in a chunk on average, and how many chunks there are
    work     : of a worker, on a chunk of average size [s]
    overhead : of a worker between two chunks, with the client's part in it [s]
    client   : of the client, which is one process: handing out, taking in, writing [s]
    """

    points: float
    chunks: int
    work: float
    overhead: float
    client: float

    def wall(self, cores: int) -> tuple[float, str]:
        """Seconds on so many cores, and what they are spent on."""
        rounds = math.ceil(self.chunks / cores) * (self.work + self.overhead)
        serial = self.chunks * self.client
        return (rounds, "the points") if rounds >= serial else (serial, "the client")

    @property
    def most_cores(self) -> float:
        """Beyond which more cores wait for the client."""
        return (self.work + self.overhead) / self.client


def overhead(rows: list[dict[str, float]]) -> tuple[float, float]:
    """Seconds between two chunks in the client's loop, and seconds a point, of a straight line.

    rows : of chunks of several sizes through two workers, "wall" seconds a chunk
    """
    points = np.array([row["points"] for row in rows])
    wall = np.array([row["wall"] for row in rows])
    # Relative errors are alike: the small chunks tell the overhead, the large ones the points.
    slope, start = np.polyfit(points, wall, 1, w=1.0 / wall)
    return float(start), float(slope)


def chunk_of(found: dict[str, Any]) -> Chunk:
    """From the measured figures. Two workers halve what a chunk seems to cost."""
    one = found["chunk"]
    average = SIDE**2 / one["chunks"]
    between = overhead(found["cluster"])[0] if found["cluster"] else 0.0
    return Chunk(
        points=average,
        chunks=one["chunks"],
        work=one["work"] * average / one["points"],
        overhead=2.0 * between,
        client=between + one["writing"],
    )


def page(found: dict[str, Any]) -> str:
    """The page."""
    here, one, chunk = found["machine"], found["chunk"], chunk_of(found)
    between, _ = overhead(found["cluster"]) if found["cluster"] else (math.nan, 0.0)
    core_hours = chunk.chunks * chunk.work / 3600.0
    alone = chunk.chunks * chunk.work / here["processors"]
    bands = max(1, math.ceil(10_000 / chunk.most_cores))
    return TEMPLATE.read_text(encoding="utf-8").format(
        processor=here["processor"],
        processors=here["processors"],
        load=f"{here['load']:.1f}",
        periods=_periods(found),
        points=_points(found),
        fits=_fits(found),
        cluster=_cluster(found["cluster"]),
        chunk_points=one["points"],
        chunks=f"{one['chunks']:,}".replace(",", " "),
        average=f"{chunk.points:.0f}",
        work=_time(chunk.work),
        point_work=_time(chunk.work / chunk.points),
        building=_time(one["building"]),
        between=_time(between),
        writing=_time(one["writing"]),
        client=_time(chunk.client),
        share=f"{100.0 * chunk.overhead / (chunk.work + chunk.overhead):.2g}",
        core_hours=f"{core_hours:.1f}",
        walls=_walls(chunk, here["processors"], alone),
        most=f"{chunk.most_cores:.0f}",
        bands=bands,
        banded=_time(chunk.wall(10_000 // bands)[0] / bands + chunk.work),
        per_second=f"{10_000 / (chunk.work + chunk.overhead):,.0f}".replace(",", " "),
        client_second=f"{1.0 / chunk.client:.0f}",
        files=f"{one['chunks']:,}".replace(",", " "),
        per_point=f"{one['stored'] / one['points']:.0f}",
        stored=f"{one['stored'] * one['chunks'] * chunk.points / one['points'] / 2**30:.1f}",
        checking=_time(one["checking"] * one["chunks"]),
        raw=f"{one['raw'] * SIDE**2 / 2**30:.0f}",
        answer=f"{one['answer'] / 2**10:.0f}",
        flow=f"{one['answer'] / chunk.client / 2**20:.0f}",
        plan=f"{one['plan'] / 2**10:.0f}",
        held=f"{one['answer'] * 10_000 / 2**30:.1f}",
    )


def _periods(found: dict[str, Any]) -> str:
    head = "| periods | " + " | ".join(f"{LAW_WORDS[law]} [ms a point]" for law in LAW_WORDS)
    lines = [head + " |", "|--:|" + "--:|" * len(LAW_WORDS)]
    for rows in zip(*(found["periods"][law] for law in LAW_WORDS), strict=True):
        cells = " | ".join(f"{1e3 * row['seconds']:.3g}" for row in rows)
        lines.append(f"| {rows[0]['periods']} | {cells} |")
    return "\n".join(lines)


def _points(found: dict[str, Any]) -> str:
    lines = ["| law | points | time | points a second | memory | store | files |"]
    lines.append("|---|--:|--:|--:|--:|--:|--:|")
    for law, words in LAW_WORDS.items():
        for row in found["points"][law]:
            rate = row["points"] / row["seconds"]
            lines.append(
                f"| {words} | {row['points']} | {_time(row['seconds'])} | {rate:.0f}"
                f" | {row['memory'] / 2**20:.0f} MiB | {row['bytes'] / 2**20:.2g} MiB"
                f" | {row['files']} |"
            )
    return "\n".join(lines)


def line(x: list[float], y: list[float]) -> tuple[float, float, float]:
    """y = start + slope x by least squares of relative errors, and the largest of these."""
    slope, start = np.polyfit(x, y, 1, w=1.0 / np.array(y))
    away = np.abs((start + slope * np.array(x)) / np.array(y) - 1.0).max()
    return float(start), float(slope), float(away)


def slope(x: list[float], y: list[float]) -> tuple[float, float]:
    """Of log y over log x, with its standard error."""
    (found, _), spread = np.polyfit(np.log(x), np.log(y), 1, cov=True)
    return float(found), float(spread[0, 0] ** 0.5)


def _fits(found: dict[str, Any]) -> str:
    lines = ["| law | over | time at 0 | for each | largest deviation | slope, large sizes |"]
    lines.append("|---|---|--:|--:|--:|--:|")
    for law, words in LAW_WORDS.items():
        for name in ("periods", "points"):
            x = [row[name] for row in found[name][law]]
            y = [row["seconds"] for row in found[name][law]]
            start, each, away = line(x, y)
            large = [i for i, size in enumerate(x) if size >= LARGE[name]]
            found_slope, error = slope([x[i] for i in large], [y[i] for i in large])
            lines.append(
                f"| {words} | {name} | {_time(start)} | {_time(each)} | {100.0 * away:.0f} %"
                f" | {found_slope:.2f} ± {error:.2f} |"
            )
    return "\n".join(lines)


def _cluster(rows: list[dict[str, float]]) -> str:
    if not rows:
        return "(distributed was not installed.)"
    lines = ["| points in a chunk | chunks | between two chunks |", "|--:|--:|--:|"]
    lines += [f"| {row['points']} | {row['chunks']} | {_time(row['wall'])} |" for row in rows]
    return "\n".join(lines)


def _walls(chunk: Chunk, processors: int, alone: float) -> str:
    lines = ["| on | time | spent on |", "|---|--:|---|"]
    lines.append(f"| this machine, {processors} threads | {_time(alone)} | the points |")
    for cores in (100, 10_000):
        seconds, spent = chunk.wall(cores)
        lines.append(f"| {cores} cores, Dask | {_time(seconds)} | {spent} |")
    return "\n".join(lines)


def _time(seconds: float) -> str:
    """With a fitting unit, to three digits."""
    if seconds >= 3600.0:
        return f"{seconds / 3600.0:.1f} h"
    if seconds >= 120.0:
        return f"{seconds / 60.0:.1f} min"
    return f"{seconds:.3g} s" if seconds >= 1.0 else f"{seconds * 1e3:.3g} ms"
