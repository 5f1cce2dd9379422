"""Nodes that are served in a thread, while the test observes them from its own."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def served(step: Callable[[], object]) -> Iterator[None]:
    """Repeat a step, which serves for a short time, until the block ends."""
    ended = threading.Event()

    def serve() -> None:
        while not ended.is_set():
            step()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join(10.0)
