"""What a browser says, as far as it is known."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

OnEvent = Callable[[dict[str, Any]], None]


def passing(on_event: OnEvent, known: Collection[str]) -> Callable[[Any], None]:
    """Pass on what a part's script sends, if it is one of the known types.

    A browser can send anything; what is not understood is ignored.
    """

    def heard(event: Any) -> None:
        data = getattr(event, "data", None)
        if isinstance(data, dict) and isinstance(data.get("type"), str) and data["type"] in known:
            on_event(data)

    return heard
