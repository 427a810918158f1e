"""Thresholds of Python's garbage collection: for commands, which end soon, and for a server."""

import gc

_USUAL = gc.get_threshold()


def make_rare() -> None:
    """Collect garbage rarely.

    Libraries create hundreds of thousands of permanent objects on import: a collection after every
    700 finds nothing and costs a quarter of a second.
    """
    gc.set_threshold(50_000, 10, 10)


def make_usual() -> None:
    """Collect garbage as Python does by default: a server that runs for days must free memory."""
    gc.set_threshold(*_USUAL)
