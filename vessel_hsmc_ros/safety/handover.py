"""The way from one command to another at a bounded rate."""

import math

Pair = tuple[float, float]


def towards(previous: Pair, wanted: Pair, rates: Pair, period: float) -> Pair:
    """The command on the way from the previous to the wanted one: |command - previous| <= rate·period in each component, exactly.

    Args:
        previous, wanted: Finite commands, N and N·m.
        rates: Largest changes per second.
        period: Time since the previous command, s.
    """
    return (
        _moved(previous[0], wanted[0], rates[0] * period),
        _moved(previous[1], wanted[1], rates[1] * period),
    )


def _moved(start: float, end: float, change: float) -> float:
    if abs(end - start) <= change:
        return end
    moved = start + math.copysign(change, end - start)
    # The sum is rounded: it may be one unit in the last place too far.
    while abs(moved - start) > change:
        moved = math.nextafter(moved, start)
    return moved
