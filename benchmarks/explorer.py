"""The explorer: how soon the page follows a slider, and how many pages one server bears.

Measured in the real Chromium, from a changed number to the frame painted after the
new motion, or the new diagram, has arrived; in processor time of the server, from the request
for a page to its document; and with twenty sessions over websockets for a minute, each of which
moves a slider every two seconds.

    python benchmarks/explorer.py [--seconds 60] [--rounds 3]
"""

import argparse
import asyncio
import os
import re
import statistics
import subprocess
import sys
import threading
import time
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "app"))
import wire

_FLAGS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
_RELEASES, _SESSIONS, _BETWEEN = 40, 20, 2.0
# Number of pages opened, and idle time before each [s].
_PAGES, _IDLE = 10, 5.0

# Change an input; the time [ms] until what follows has been painted.
_MEASURE = """
async ([name, value, what]) => {
  const deep = (root, selector) => {
    for (const one of root.querySelectorAll("*")) {
      if (one.matches(selector)) return one;
      const found = one.shadowRoot && deep(one.shadowRoot, selector);
      if (found) return found;
    }
  };
  const frame = () => new Promise((done) => requestAnimationFrame(done));
  const shown = () => Number(deep(document, `[data-${what}]`)?.getAttribute(`data-${what}`) ?? 0);
  const input = deep(document, `.input-${name}`).shadowRoot.querySelector("input");
  const before = shown(), begin = performance.now();
  input.value = value;
  input.dispatchEvent(new Event("change", { bubbles: true }));
  while (shown() <= before && performance.now() - begin < 20000) await frame();
  if (shown() <= before) throw new Error(`no ${what} within 20 s`);
  await frame();
  return performance.now() - begin;
}
"""


def serve():
    command = [sys.executable, "-m", "wedgebrake", "app", "--port", "0", "--no-browser"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)  # noqa: S603
    lines = []
    for line in process.stderr:
        lines.append(line)
        if found := re.search(r"http://\S+", line):
            threading.Thread(target=lambda: lines.extend(process.stderr), daemon=True).start()
            return process, found[0], lines
    raise SystemExit("the explorer did not start: " + "".join(lines))


def in_browser(url):
    """Median and 90 % [ms] from a slider's release to motion, and to diagram."""
    from playwright.sync_api import sync_playwright

    results = {}
    with sync_playwright() as playwright:
        path = os.environ.get("WEDGEBRAKE_CHROMIUM", "/usr/bin/chromium")
        browser = playwright.chromium.launch(executable_path=path, args=_FLAGS)
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        begin = time.perf_counter()
        page.goto(url)
        page.locator("[data-motion='1']").wait_for(timeout=120_000)
        results["first page"] = [1e3 * (time.perf_counter() - begin)]
        time.sleep(3)
        for label, name, low, high, what in (
            # The diagram goes over eta: moving eta moves the motion alone, F0 the diagram too.
            ("motion, verdict", "eta", -60.0, 12.0, "motion"),
            ("motion, verdict, with diagram", "F0", 0.01, 0.12, "motion"),
            ("diagram, 150 values", "F0", 0.01, 0.12, "picture"),
        ):
            times = []
            for i in range(_RELEASES):
                share = 0.05 + 0.9 * ((0.31 + i * 0.618) % 1.0)
                value = f"{low + share * (high - low):.4g}"
                times.append(page.evaluate(_MEASURE, [name, value, what]))
                time.sleep(0.5)
            results[label] = times
        browser.close()
    return results


async def opening(url, process):
    """Processor time of the server [ms] for each of some pages, one after the other."""
    server, times = psutil.Process(process.pid), []

    def spent():
        passed = server.cpu_times()
        return 1e3 * (passed.user + passed.system)

    for _ in range(_PAGES):
        await asyncio.sleep(_IDLE)
        begin = spent()
        client = await wire.Client(url).open()
        times.append(spent() - begin)
        await client.leave()
    return times


async def one_session(url, seconds, number, times, errors):
    await asyncio.sleep(number * _BETWEEN / _SESSIONS)
    try:
        client = await wire.Client(url).open()
        await client.until("motion", 1)
        end, edits = time.monotonic() + seconds, 1
        while time.monotonic() < end:
            begin = time.perf_counter()
            name, low, high = (("eta", -55.0, 5.0), ("F0", 0.02, 0.1))[edits % 2]
            value = low + (high - low) * ((edits * 0.618 + number * 0.11) % 1.0)
            await client.edit(**{name: value})
            edits += 1
            await client.until("motion", edits)
            times.append(time.perf_counter() - begin)
            await asyncio.sleep(max(0.0, _BETWEEN - (time.perf_counter() - begin)))
        client.close()
    except Exception as error:
        errors.append(f"session {number}: {type(error).__name__}: {error}")


async def many_sessions(url, seconds, process):
    """Times [s] from edit to motion, errors, and memory [MiB] through the minute."""
    times, errors, memory = [], [], []
    server = psutil.Process(process.pid)

    async def watch():
        while True:
            memory.append(server.memory_info().rss / 2**20)
            await asyncio.sleep(5)

    watching = asyncio.create_task(watch())
    await asyncio.gather(*(one_session(url, seconds, i, times, errors) for i in range(_SESSIONS)))
    watching.cancel()
    return times, errors, memory


def show(name, values, unit="ms"):
    ordered = sorted(values)
    ninth = ordered[int(0.9 * (len(ordered) - 1))]
    print(
        f"{name:34s} median {statistics.median(ordered):7.0f} {unit}   90 % {ninth:7.0f} {unit}"
        f"   of {len(ordered)}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rounds", type=int, default=3, help="do later ones need more memory?")
    given = parser.parse_args()
    seconds = given.seconds
    process, url, lines = serve()
    try:
        for name, values in in_browser(url).items():
            show(name, values)
        show("opening a page, processor time", asyncio.run(opening(url, process)))
        for round_ in range(1, given.rounds + 1):
            times, errors, memory = asyncio.run(many_sessions(url, seconds, process))
            show(f"{_SESSIONS} sessions, {seconds:g} s, round {round_}", [1e3 * t for t in times])
            print(f"  errors: {errors or 'none'}")
            print("  memory [MiB]: " + " ".join(f"{one:.0f}" for one in memory))
            time.sleep(25)  # pages that nobody looks at are closed
            after = psutil.Process(process.pid).memory_info().rss / 2**20
            print(f"  memory after the pages have closed: {after:.0f} MiB")
    finally:
        process.terminate()
        process.wait(20)
    trouble = [line for line in lines if "rror" in line]
    print("server:", "".join(trouble) or "no error")


if __name__ == "__main__":
    main()
