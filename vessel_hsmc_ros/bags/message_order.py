"""The order of a bag's messages, which are recorded nearly but not quite in the order of their log times."""

import heapq
from collections.abc import Iterable, Iterator

from vessel_hsmc_ros.bags.files import RawMessage

NEIGHBOURS = 4096
"""Size of the window, in messages, within which messages are sorted by log time."""


def by_log_time(messages: Iterable[RawMessage]) -> Iterator[RawMessage]:
    """Messages in the order of their log times; one that comes more than NEIGHBOURS messages late stays out of order."""
    waiting: list[tuple[int, int, RawMessage]] = []
    # The number keeps messages of equal time in the recorded order, and messages themselves from being compared.
    for number, message in enumerate(messages):
        heapq.heappush(waiting, (message.log_time, number, message))
        if len(waiting) > NEIGHBOURS:
            yield heapq.heappop(waiting)[2]
    while waiting:
        yield heapq.heappop(waiting)[2]
