"""Calls on the event loop of a page, from any thread."""

from collections.abc import Callable

import panel as pn
from tornado.ioloop import IOLoop

Call = Callable[[], None]


def page_caller(is_closed: Callable[[], bool]) -> Callable[[Call], None]:
    """Return a function that calls another one on the event loop of the present page.

    Bokeh's documents may lose callbacks that other threads add to them.

    is_closed : whether the page has been closed; calls are then ignored
    """
    document, loop = pn.state.curdoc, IOLoop.current()

    def post(call: Call) -> None:
        def add() -> None:
            if not is_closed():
                document.add_next_tick_callback(call)

        loop.add_callback(add)

    return post
