"""The diagnostic tasks that several nodes have in common, as statuses of /diagnostics."""

import math
import shutil
import time
from collections import deque
from collections.abc import Mapping
from pathlib import Path

from vessel_hsmc_ros.nodes.reporting import ERROR, OK, STALE, WARN, DiagnosticTask

MINUTE = 60.0
"""Time over which events are counted, s."""

TOLERATED = 5
"""Events a minute that are not worth a warning, such as periods that a busy machine missed."""

LOW_SPACE, NO_SPACE = 1e9, 1e8
"""Free disk space below which a recording is in danger, and will end soon, bytes."""

LONGEST_WAIT = 5.0
"""Longest time for which a message may wait for the recorder, s; on a busy machine a second or two are normal, and harmless."""


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


def ages(name: str, seconds: Mapping[str, float | None], limit: float) -> DiagnosticTask:
    """The ages of the messages on which a node depends.

    Args:
        name: Name of the task.
        seconds: Age of the latest message by its name, s; None where none has been received.
        limit: Age above which a message no longer counts, s; infinite in lockstep.
    """
    old = [key for key, age in seconds.items() if (math.inf if age is None else age) > limit]
    shown = {key: math.nan if age is None else round(age, 6) for key, age in seconds.items()}
    message = f"no recent {' and '.join(old)}" if old else "all recent"
    return DiagnosticTask(name, STALE if old else OK, message, {**shown, "limit": limit})


def counted(name: str, count: int, recent: int, of: float, what: str) -> DiagnosticTask:
    """Events that should not occur: a warning from TOLERATED a minute on, an error where they are one of twenty.

    Args:
        name: Name of the task.
        count: Their number since the start.
        recent: Their number in the last minute.
        of: How many could have occurred in it.
        what: What they are, in the plural.
    """
    level = ERROR if recent > max(TOLERATED, 0.05 * of) else WARN if recent > TOLERATED else OK
    return DiagnosticTask(name, level, f"{recent} {what} in the last minute", {"total": count, "last_minute": recent})


def saturation(share: float, lasting: bool) -> DiagnosticTask:
    """How much of the time a command is limited.

    Args:
        share: Share of the commands of the last minute that were limited.
        lasting: Whether a command has been at one limit for longer than is normal.
    """
    message = "at a limit for too long" if lasting else f"{share:.0%} of the last minute at a limit"
    return DiagnosticTask("saturation", WARN if lasting else OK, message, {"share": round(share, 4)})


def bounded(name: str, values: Mapping[str, float], limit: float) -> DiagnosticTask:
    """Magnitudes that should stay below a limit; NaN stands for a value that does not exist.

    Args:
        name: Name of the task.
        values: By their names.
        limit: A magnitude above it is a warning.
    """
    present = {key: abs(value) for key, value in values.items() if not math.isnan(value)}
    above = [key for key, value in present.items() if value > limit]
    message = f"{' and '.join(above)} above {limit:g}" if above else "within its limit" if present else "the law has none"
    return DiagnosticTask(name, WARN if above else OK, message, {**present, "limit": limit})


def motion(values: Mapping[str, float], refused: str) -> DiagnosticTask:
    """Whether a reference can be followed.

    Args:
        values: Its present velocities and accelerations by name.
        refused: Why the latest goal or path was ignored; empty if it was not.
    """
    wrong = [key for key, value in values.items() if not math.isfinite(value)]
    if wrong:
        return DiagnosticTask("feasibility", ERROR, f"not finite: {', '.join(wrong)}", dict(values))
    return DiagnosticTask("feasibility", WARN if refused else OK, refused or "feasible", dict(values))


def recording(directory: Path, waited: float, dropped: int) -> list[DiagnosticTask]:
    """The diagnostic tasks of a recorder: its queue, the space left on its disk, gaps in its topics.

    Args:
        directory: The bag's folder.
        waited: Longest time for which a message has waited since the last call, s.
        dropped: Number of messages that are missing.
    """
    slow = waited > LONGEST_WAIT
    gaps = f"{dropped} messages are missing" if dropped else "no message is missing"
    return [
        DiagnosticTask("queue", WARN if slow else OK, f"messages wait for {waited:.2f} s", {"longest_wait": round(waited, 4)}),
        _space(directory),
        DiagnosticTask("gaps", WARN if dropped else OK, gaps, {"dropped": dropped}),
    ]


def _space(directory: Path) -> DiagnosticTask:
    try:
        free = shutil.disk_usage(directory).free
    except OSError as error:
        return DiagnosticTask("disk space", STALE, f"unknown: {error.strerror}", {})
    level = ERROR if free < NO_SPACE else WARN if free < LOW_SPACE else OK
    return DiagnosticTask("disk space", level, f"{free / 1e9:.1f} GB left", {"free": free})
