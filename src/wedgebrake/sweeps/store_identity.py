"""What a store was computed from, and how that differs from what is asked for now."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wedgebrake.errors import InputError, OutputError
from wedgebrake.sweeps.store_files import reason, replace_file
from wedgebrake.sweeps.store_layout import IDENTITY, PARTIAL, Layout, fault

_FORMAT = "wedgebrake sweep 1"

_SHOWN = 8
_WIDTH = 60
_ABSENT = object()


def description(layout: Layout, identity: Any) -> dict[str, Any]:
    """What a store says of itself in identity.json."""
    return {
        "format": _FORMAT,
        "identity": _plain(identity),
        "layout": _plain(
            {
                "dims": layout.dims,
                "variables": {one.name: [one.dtype, dims] for one, dims in layout.variables},
                "chunks": {name: layout.length(name) for name in layout.point_dims},
            }
        ),
    }


def verify(target: Path, layout: Layout, record: dict[str, Any]) -> Layout:
    """Compare a store with what is asked for, and give the layout that it has."""
    stored = _read_json(target, IDENTITY)
    if not isinstance(stored, dict) or stored.get("format") != _FORMAT:
        raise _damaged(target, IDENTITY, f"it is not of the format {_FORMAT!r}")
    has: Any = stored.get("layout")
    try:
        lines = differences(stored["identity"], record["identity"]) or differences(
            {name: has[name] for name in ("dims", "variables")},
            {name: record["layout"][name] for name in ("dims", "variables")},
        )
        if not lines:
            layout = dataclasses.replace(layout, chunks=_lengths(has["chunks"]))
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise _damaged(target, IDENTITY, f"{type(error).__name__}: {error}") from None
    if lines:
        raise InputError(
            f"path = {str(target)!r}: holds another sweep:{_shorten(lines)}\nGive what it was"
            " computed with (and, where the version differs, install that one) to go on with"
            " it, or choose another name."
        )
    _check_arrays(target, layout)
    return layout


def _lengths(chunks: Any) -> dict[str, int]:
    """Chunk lengths of a store, which may differ from those of the call."""
    if not all(type(length) is int for length in chunks.values()):
        raise TypeError(f"chunks = {chunks!r}")
    return dict(chunks)


def _check_arrays(target: Path, layout: Layout) -> None:
    """Refuse metadata that is missing or altered; write coordinates again if need be.

    Each document is compared completely: its text is part of the result, and zarr reads the rest.
    """
    for key, content in layout.files.items():
        if not key.endswith("zarr.json"):
            _mend(target, key, content)
            continue
        stored, wanted = _read_json(target, key), json.loads(content)
        if _exactly(stored) != _exactly(wanted):
            lines = differences(stored, wanted) or ["its numbers have a different type"]
            raise _damaged(target, key, "; ".join(lines[:_SHOWN]))


def _exactly(document: Any) -> str:
    """Canonical text of a document, which distinguishes 1 from 1.0."""
    return json.dumps(document, sort_keys=True)


def _mend(target: Path, key: str, content: bytes) -> None:
    """Write a coordinate again where its file is damaged: what it must be is known."""
    if fault(target / key) is None:
        return
    try:
        replace_file(target / key, content, target / PARTIAL)
    except OSError as error:
        raise OutputError(
            f"path = {str(target)!r}: {key} is damaged and cannot be written again"
            f" ({reason(error)}). Mend the cause, for example make room on the disk."
        ) from None


def _read_json(target: Path, key: str) -> Any:
    try:
        return json.loads((target / key).read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        why = reason(error) if isinstance(error, OSError) else f"not JSON: {error}"
        raise _damaged(target, key, why) from None


def _damaged(target: Path, key: str, why: str) -> InputError:
    return InputError(
        f"path = {str(target)!r}: the store is damaged: {key} cannot be used ({why}). Put that"
        " file back from a copy, or choose another name to compute the sweep again."
    )


def _plain(value: Any) -> Any:
    """A copy as JSON gives it back: arrays and tuples as lists, numbers of numpy as Python's."""
    return json.loads(json.dumps(value, default=lambda one: one.tolist()))


def differences(stored: Any, now: Any) -> list[str]:
    """Every difference of two nested JSON values, a line for each, in the store's order.

    A line names its place with dots and brackets; a list gives one line, for its length or
    its first element that differs.
    """
    return list(_walk("", stored, now))


def _shorten(lines: list[str]) -> str:
    """The first eight lines and the number of all others."""
    rest = len(lines) - _SHOWN
    text = "".join(f"\n  {line}" for line in lines[:_SHOWN])
    return text + (f"\n  and {rest} more" if rest > 0 else "")


def _walk(place: str, stored: Any, now: Any) -> Iterator[str]:
    if isinstance(stored, dict) and isinstance(now, dict):
        for name in [*stored, *(name for name in now if name not in stored)]:
            inside = f"{place}.{name}" if place else name
            yield from _walk(inside, stored.get(name, _ABSENT), now.get(name, _ABSENT))
    elif isinstance(stored, list) and isinstance(now, list):
        yield from _walk_list(place, stored, now)
    elif not _same(stored, now):
        yield f"{place}: {_text(stored)} in the store, {_text(now)} now"


def _walk_list(place: str, stored: list[Any], now: list[Any]) -> Iterator[str]:
    if len(stored) != len(now):
        yield f"{place}: {len(stored)} values in the store, {len(now)} now"
        return
    pairs = zip(stored, now, strict=True)
    unlike = [number for number, pair in enumerate(pairs) if next(_walk("", *pair), None)]
    if unlike:
        first = unlike[0]
        *lines, last = _walk(f"{place}[{first}]", stored[first], now[first])
        yield from lines
        yield last + (f" (and {len(unlike) - 1} more of its values)" if len(unlike) > 1 else "")


def _same(stored: Any, now: Any) -> bool:
    """Equal, where 1 is 1.0 but not true, and not-a-number is itself."""
    if isinstance(stored, bool) or isinstance(now, bool):
        return stored is now
    # Not-a-number differs from itself.
    return bool(stored == now) or (stored != stored and now != now)


def _text(value: Any) -> str:
    if value is _ABSENT:
        return "nothing"
    text = value if isinstance(value, str) and value else json.dumps(value)
    return text if len(text) <= _WIDTH else f"{text[: _WIDTH - 3]}..."
