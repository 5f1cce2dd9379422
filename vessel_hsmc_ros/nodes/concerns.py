"""The concerns that several nodes have in common, as statuses of /diagnostics."""

import math
import time
from collections import deque
from collections.abc import Mapping

from vessel_hsmc_ros.nodes.reporting import ERROR, OK, STALE, WARN, Concern

MINUTE = 60.0
"""Time over which events are counted, s."""

TOLERATED = 5
"""Events a minute that are not worth a warning, such as periods that a busy machine missed."""


class Recent:
    """The increase of a counter in the last minute of wall time."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque()

    def increase(self, count: int) -> int:
        """Note the present count; returns by how much it has grown since a minute ago, or since the first call."""
        now = time.monotonic()
        self._seen.append((now, count))
        while now - self._seen[0][0] > MINUTE:
            self._seen.popleft()
        return max(0, count - self._seen[0][1])


def ages(name: str, seconds: Mapping[str, float | None], limit: float) -> Concern:
    """The ages of the messages on which a node depends.

    Args:
        name: Name of the concern.
        seconds: Age of the latest message by its name, s; None where none has been received.
        limit: Age above which a message no longer counts, s; infinite in lockstep.
    """
    old = [key for key, age in seconds.items() if (math.inf if age is None else age) > limit]
    shown = {key: math.nan if age is None else round(age, 6) for key, age in seconds.items()}
    message = f"no recent {' and '.join(old)}" if old else "all recent"
    return Concern(name, STALE if old else OK, message, {**shown, "limit": limit})


def counted(name: str, count: int, recent: int, of: float, what: str) -> Concern:
    """Events that should not occur: a warning from TOLERATED a minute on, an error where they are one of twenty.

    Args:
        name: Name of the concern.
        count: Their number since the start.
        recent: Their number in the last minute.
        of: How many could have occurred in it.
        what: What they are, in the plural.
    """
    level = ERROR if recent > max(TOLERATED, 0.05 * of) else WARN if recent > TOLERATED else OK
    return Concern(name, level, f"{recent} {what} in the last minute", {"total": count, "last_minute": recent})


def saturation(share: float, lasting: bool) -> Concern:
    """How much of the time a command is limited.

    Args:
        share: Share of the commands of the last minute that were limited.
        lasting: Whether a command has been at one limit for longer than is normal.
    """
    message = "at a limit for too long" if lasting else f"{share:.0%} of the last minute at a limit"
    return Concern("saturation", WARN if lasting else OK, message, {"share": round(share, 4)})


def bounded(name: str, values: Mapping[str, float], limit: float) -> Concern:
    """Magnitudes that should stay below a limit; NaN stands for a value that does not exist.

    Args:
        name: Name of the concern.
        values: By their names.
        limit: A magnitude above it is a warning.
    """
    present = {key: abs(value) for key, value in values.items() if not math.isnan(value)}
    above = [key for key, value in present.items() if value > limit]
    message = f"{' and '.join(above)} above {limit:g}" if above else "within its limit" if present else "the law has none"
    return Concern(name, WARN if above else OK, message, {**present, "limit": limit})
