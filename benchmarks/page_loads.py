"""The explorer's page: what opening it costs the server, and what a user notices of many loads.

Processor time of the server for one load, until its document has been sent and until its first
motion is shown, without the diagram that is computed afterwards; the longest time for which a
callback holds the event loop; and the time from a user's edit to the new motion, alone and while
a hundred browsers open the page at once.

    python benchmarks/page_loads.py [--loads 100]
"""

import argparse
import asyncio
import contextlib
import multiprocessing
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "app"))
import wire

ROOT = Path(__file__).parent.parent
# The command, which reports each callback that holds the event loop for more than 10 ms.
_PROGRAM = """
import asyncio, sys, time
from wedgebrake.cli import process_main
run = asyncio.events.Handle._run
def timed(handle):
    begin, used = time.perf_counter(), time.thread_time()
    run(handle)
    held, used = time.perf_counter() - begin, time.thread_time() - used
    if held > 0.01:
        print(f"held {held} {used}", file=sys.stderr, flush=True)
asyncio.events.Handle._run = timed
process_main()
"""
# Number of single loads, idle time before each [s], number of edits alone.
_SINGLE, _IDLE, _EDITS = 8, 4.0, 10


class Server:
    """The command; ``holds`` are times [s] for which its loop is held, and processor times."""

    def __init__(self, *arguments):
        command = [sys.executable, "-c", _PROGRAM, "app", *arguments, "--port", "0", "--no-browser"]
        self._process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)  # noqa: S603
        self.holds, self.url = [], ""
        for line in self._process.stderr:
            if found := re.search(r"http://\S+", line):
                self.url = found[0]
                break
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        for line in self._process.stderr:
            if line.startswith("held "):
                self.holds.append([float(one) for one in line.split()[1:]])
            else:
                sys.stderr.write(line)

    def spent(self):
        """Processor time [s]."""
        times = psutil.Process(self._process.pid).cpu_times()
        return times.user + times.system

    def stop(self):
        self._process.terminate()
        self._process.wait(20)


class Load(wire.Client):
    """A browser that opens the page and reads what it is sent, without looking at it."""

    def _notice(self, content):
        pass

    async def stay(self):
        with contextlib.suppress(ConnectionError):
            while True:
                await self._receive()


async def single(server, count):
    """Processor time [s] of single loads: until the document, and until the first motion."""
    documents, motions = [], []
    for _ in range(count):
        await asyncio.sleep(_IDLE)  # until the diagram of the last load is complete
        begin = server.spent()
        client = await wire.Client(server.url).open()
        documents.append(server.spent() - begin)
        await client.until("motion", 1)
        motions.append(server.spent() - begin)
        await client.leave()
    return documents, motions


async def edits(url, begun, ended):
    """Times [s] from edits of a user to the motion: alone, and while others open the page."""
    client = await wire.Client(url).open()
    await client.until("motion", 1)
    times, number = {False: [], True: []}, 1
    while len(times[False]) < _EDITS or not (begun.is_set() and ended.is_set()):
        if len(times[False]) == _EDITS:
            begun.set()
        number += 1
        begin = time.perf_counter()
        await client.edit(eta=-6.0 - 0.01 * number)
        await client.until("motion", number)
        times[begun.is_set()].append(time.perf_counter() - begin)
        await asyncio.sleep(0.2)
    await client.leave()
    return times[False], times[True]


def many(url, count, begun, ended, results):
    """Open pages at once; the times [s] until each has its document."""

    async def load():
        begin = time.perf_counter()
        client = await Load(url).open()
        return time.perf_counter() - begin, asyncio.create_task(client.stay())

    async def all_loads():
        found = await asyncio.gather(*(load() for _ in range(count)))
        ended.set()
        results.put([seconds for seconds, _ in found])
        await asyncio.sleep(2.0)

    begun.wait()
    asyncio.run(all_loads())


def show(name, values):
    print(f"{name:50s} median {1e3 * statistics.median(values):7.0f} ms"
          f"   longest {1e3 * max(values):7.0f} ms   of {len(values)}", flush=True)  # fmt: skip


def show_holds(when, server):
    """Callbacks that have held the event loop for more than 10 ms, since the last call."""
    for what, times in zip(
        ("held", "processor time"), zip(*server.holds, strict=True), strict=True
    ):
        show(f"event loop, {what}, {when}", times)
    server.holds.clear()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--loads", type=int, default=100)
    given = parser.parse_args()
    # With little to compute: it is the page that is measured.
    paper = (ROOT / "examples" / "paper.toml").read_text(encoding="utf-8")
    study = Path(tempfile.mkdtemp()) / "small.toml"
    study.write_text(paper.replace("-24.0", "-6.0").replace("duration = 25.0", "periods = 20"))
    server = Server(str(study))
    try:
        asyncio.run(single(server, 1))  # compiles, reads files
        server.holds.clear()
        documents, motions = asyncio.run(single(server, _SINGLE))
        show("processor time of a load, until its document", documents)
        show("processor time of a load, until its motion", motions)
        show_holds("single loads", server)
        begun, ended, results = (
            multiprocessing.Event(), multiprocessing.Event(), multiprocessing.Queue(),
        )  # fmt: skip
        others = multiprocessing.Process(
            target=many, args=(server.url, given.loads, begun, ended, results)
        )
        others.start()
        alone, beside = asyncio.run(edits(server.url, begun, ended))
        others.join()
        show("from an edit to the motion, alone", alone)
        show(f"from an edit to the motion, beside {given.loads} loads", beside)
        show(f"until a document, {given.loads} loads at once", results.get())
        show_holds(f"{given.loads} loads at once", server)
    finally:
        server.stop()


if __name__ == "__main__":
    main()
