"""Work in turns: the newest wish wins, others have their turns, failures are sentences."""

import threading
import time

import pytest

from wedgebrake.errors import InputError
from wedgebrake.explorer.core.scheduler import Scheduler


@pytest.fixture
def scheduler():
    made = Scheduler(threads=2)
    yield made
    made.close()


def directly(call):
    call()


def until(condition, seconds=10.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.001)


def unexpected(words):
    raise AssertionError(words)


def test_every_step_is_shown_and_then_the_end(scheduler):
    seen = []
    slot = scheduler.slot(directly)
    slot.start(iter([1, 2, 3]), seen.append, unexpected, finished=lambda: seen.append("end"))
    until(lambda: not slot.busy)
    assert seen == [1, 2, 3, "end"]


def test_newer_work_replaces_older(scheduler):
    seen, running, go = [], threading.Event(), threading.Event()

    def old():
        running.set()
        assert go.wait(10)
        yield "old"
        yield "older"

    slot = scheduler.slot(directly)
    slot.start(old(), seen.append, unexpected)
    assert running.wait(10)
    slot.start(iter(["new"]), seen.append, unexpected)
    go.set()
    until(lambda: not slot.busy)
    assert seen == ["old", "new"]


def test_work_that_nobody_wants_is_closed(scheduler):
    closed, running = threading.Event(), threading.Event()

    def endless():
        try:
            while True:
                running.set()
                time.sleep(0.001)
                yield 0
        finally:
            closed.set()

    slot = scheduler.slot(directly)
    slot.start(endless(), lambda _: None, unexpected)
    assert running.wait(10)
    slot.stop()
    assert closed.wait(10)
    assert not slot.busy


def test_a_slow_page_gets_the_newest_result_only(scheduler):
    calls, seen = [], []
    slot = scheduler.slot(calls.append)
    slot.start(iter(range(100)), seen.append, unexpected, finished=lambda: seen.append("end"))
    until(lambda: len(calls) == 2)  # one to show what there is, one for the end
    for call in calls:
        call()
    assert seen == [99, "end"]


def test_what_is_urgent_comes_first_and_finer_work_waits(scheduler):
    order, lock = [], threading.Lock()
    blocked, go = threading.Barrier(3), threading.Event()

    def block():
        blocked.wait(10)
        assert go.wait(10)
        yield None

    def steps(name, count):
        for _ in range(count):
            with lock:
                order.append(name)
            yield None

    blockers = [scheduler.slot(directly) for _ in range(2)]
    for slot in blockers:
        slot.start(block(), lambda _: None, unexpected)
    blocked.wait(10)
    slots = [scheduler.slot(directly) for _ in range(2)]
    slots[0].start(steps("picture", 3), lambda _: None, unexpected, urgency=1, later=3)
    slots[1].start(steps("motion", 1), lambda _: None, unexpected, urgency=0)
    go.set()
    until(lambda: not any(slot.busy for slot in slots))
    assert sorted(order[:2]) == ["motion", "picture"]
    assert order.count("picture") == 3


def test_a_pause_keeps_finer_work_from_beginning(scheduler):
    times = []

    def steps():
        for _ in range(3):
            times.append(time.monotonic())
            yield None

    slot = scheduler.slot(directly)
    slot.start(steps(), lambda _: None, unexpected, pause=0.2)
    until(lambda: not slot.busy)
    assert times[1] - times[0] >= 0.19
    assert times[2] - times[1] < 0.15


def test_failures_are_told_as_sentences(scheduler, caplog):
    def wrong():
        yield 1
        raise InputError("eta = 3: must be something else.")

    def broken():
        raise ZeroDivisionError("oh")
        yield

    for steps, words in ((wrong(), "eta = 3"), (broken(), "internal error: ZeroDivisionError: oh")):
        seen, told = [], []
        slot = scheduler.slot(directly)
        slot.start(steps, seen.append, told.append)
        until(lambda slot=slot: not slot.busy)
        assert told[0].startswith(words)
    assert "a step failed" in caplog.text


def test_a_failure_of_unwanted_work_is_not_told(scheduler):
    told, running, go = [], threading.Event(), threading.Event()

    def wrong():
        running.set()
        assert go.wait(10)
        raise InputError("too late")
        yield

    slot = scheduler.slot(directly)
    slot.start(wrong(), lambda _: None, told.append)
    assert running.wait(10)
    slot.stop()
    go.set()
    time.sleep(0.05)
    assert told == []


@pytest.fixture
def impatient():
    """One thread, which is not waited for long."""
    made = Scheduler(threads=1, patience=0.05, limit=0.6)
    yield made
    made.close()


class Stuck:
    """Work that does not come back until it is let go, as a kernel that hangs."""

    def __init__(self, scheduler):
        self.running, self.go, self.closed = (threading.Event() for _ in range(3))
        self.seen, self.told = [], []
        self.slot = scheduler.slot(directly)
        self.slot.start(self.steps(), self.seen.append, self.told.append)
        assert self.running.wait(10)

    def steps(self):
        try:
            self.running.set()
            assert self.go.wait(30)
            yield "late"
            yield "later"
        finally:
            self.closed.set()


def does_work(scheduler):
    seen = []
    slot = scheduler.slot(directly)
    slot.start(iter([1, 2]), seen.append, unexpected)
    until(lambda: not slot.busy)
    return seen == [1, 2]


def test_nobody_waits_for_work_that_hangs(impatient):
    before = threading.active_count()
    stuck = [Stuck(impatient) for _ in range(5)]
    assert does_work(impatient)
    for one in stuck:
        one.go.set()
    until(lambda: threading.active_count() <= before)
    assert does_work(impatient)


def test_nor_for_work_of_a_page_that_has_gone(impatient):
    stuck = Stuck(impatient)
    stuck.slot.stop()
    assert does_work(impatient)
    stuck.go.set()
    assert stuck.closed.wait(10)
    assert stuck.seen == stuck.told == []


def test_work_that_takes_too_long_is_given_up(impatient):
    stuck = Stuck(impatient)
    until(lambda: not stuck.slot.busy)
    assert "0.6 s" in stuck.told[0]
    stuck.go.set()
    assert stuck.closed.wait(10)
    assert (stuck.seen, len(stuck.told)) == ([], 1)
    assert does_work(impatient)


def test_work_of_short_turns_may_go_on_for_longer_than_one_may_last(impatient):
    seen = []
    slot = impatient.slot(directly)
    slot.start((time.sleep(0.1) for _ in range(12)), seen.append, unexpected)
    until(lambda: not slot.busy)
    assert seen


def test_closing_ends_the_threads():
    scheduler = Scheduler(threads=2)
    before = threading.active_count()
    scheduler.close()
    until(lambda: threading.active_count() <= before - 2)


def test_a_page_that_has_gone_does_not_stop_the_others(scheduler):
    """A document that is destroyed refuses all calls; the threads go on."""

    def gone(_):
        raise AttributeError("no document")

    for _ in range(5):
        slot = scheduler.slot(gone)
        slot.start(iter([1, 2]), unexpected, unexpected)
        until(lambda slot=slot: not slot.busy)
    seen = []
    living = scheduler.slot(directly)
    living.start(iter([1, 2]), seen.append, unexpected)
    until(lambda: not living.busy)
    assert seen == [1, 2]
