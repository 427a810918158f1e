"""The scheduler: newer work replaces older, pages take turns, failures are told as sentences."""

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


@pytest.fixture
def impatient():
    """One thread, which is not waited for long."""
    made = Scheduler(threads=1, patience=0.05, limit=0.6)
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


def done(scheduler, steps, post=directly, **options):
    """What is shown of the steps of a new slot, when all is done."""
    seen = []
    slot = scheduler.slot(post)
    slot.start(iter(steps), seen.append, unexpected, **options)
    until(lambda: not slot.busy)
    return seen


class Held:
    """Work that goes on when it is let go, as a kernel that hangs; and another step after it."""

    def __init__(self, scheduler, error=None):
        self.running, self.go, self.closed = (threading.Event() for _ in range(3))
        self.seen, self.messages, self.error = [], [], error
        self.slot = scheduler.slot(directly)
        self.slot.start(self.steps(), self.seen.append, self.messages.append)
        assert self.running.wait(10)

    def steps(self):
        try:
            self.running.set()
            assert self.go.wait(30)
            if self.error is not None:
                raise self.error
            yield "late"
            yield "later"
        finally:
            self.closed.set()

    def released(self):
        """What is seen and told when it has been let go and has ended."""
        self.go.set()
        assert self.closed.wait(10)
        return self.seen, self.messages


def test_every_step_is_shown_and_then_the_end(scheduler):
    end = []
    assert done(scheduler, [1, 2, 3], finished=lambda: end.append("end")) == [1, 2, 3]
    assert end == ["end"]


def test_newer_work_replaces_older_after_its_first_result(scheduler):
    old, seen = Held(scheduler), []
    old.slot.start(iter(["new"]), seen.append, unexpected)
    assert old.released() == (["late"], [])
    until(lambda: not old.slot.busy)
    assert seen == ["new"]


def test_a_slow_page_gets_the_newest_result_only(scheduler):
    calls, seen = [], []
    slot = scheduler.slot(calls.append)
    slot.start(iter(range(100)), seen.append, unexpected, finished=lambda: seen.append("end"))
    until(lambda: len(calls) == 2)  # one to show what there is, one for the end
    for call in calls:
        call()
    assert seen == [99, "end"]


def test_what_is_urgent_comes_first_and_finer_work_waits(scheduler):
    order, blockers = [], [Held(scheduler) for _ in range(2)]

    def steps(name, count):
        for _ in range(count):
            order.append(name)
            yield None

    slots = [scheduler.slot(directly) for _ in range(2)]
    slots[0].start(steps("picture", 3), lambda _: None, unexpected, urgency=1, later=3)
    slots[1].start(steps("motion", 1), lambda _: None, unexpected, urgency=0)
    for one in blockers:
        one.released()
    until(lambda: not any(slot.busy for slot in slots))
    assert sorted(order[:2]) == ["motion", "picture"]
    assert order.count("picture") == 3


def test_failures_are_told_as_sentences(scheduler, caplog):
    for error, words in (
        (InputError("eta = 3: must be something else."), "eta = 3"),
        (ZeroDivisionError("oh"), "internal error: ZeroDivisionError: oh"),
    ):
        held = Held(scheduler, error)
        held.released()
        until(lambda held=held: held.messages)
        assert held.messages[0].startswith(words)
    assert "a step failed" in caplog.text


def test_a_failure_of_unwanted_work_is_not_told(scheduler):
    held = Held(scheduler, InputError("too late"))
    held.slot.stop()
    assert held.released() == ([], [])
    assert done(scheduler, [1, 2]) == [1, 2]
    assert held.messages == []


def test_nobody_waits_for_work_that_hangs(impatient):
    before = threading.active_count()
    stuck = [Held(impatient) for _ in range(5)]
    assert done(impatient, [1, 2]) == [1, 2]
    for one in stuck:
        one.go.set()
    until(lambda: threading.active_count() <= before)
    # Nor for that of a page that has gone.
    gone = Held(impatient)
    gone.slot.stop()
    assert done(impatient, [1, 2]) == [1, 2]
    assert gone.released() == ([], [])


def test_work_that_takes_too_long_is_given_up(impatient):
    stuck = Held(impatient)
    until(lambda: not stuck.slot.busy)
    assert "0.6 s" in stuck.messages[0]
    seen, told = stuck.released()
    assert (seen, len(told)) == ([], 1)
    assert done(impatient, [1, 2]) == [1, 2]
    # Work of short scheduler may go on for longer than one may last.
    assert done(impatient, (time.sleep(0.1) for _ in range(8)))


def test_a_page_that_has_gone_does_not_stop_the_others(scheduler):
    """A document that is destroyed refuses all calls; the threads go on."""

    def gone(_):
        raise AttributeError("no document")

    for _ in range(5):
        assert done(scheduler, [1, 2], gone) == []
    assert done(scheduler, [1, 2]) == [1, 2]
