"""The latest problem of a node, shown in its diagnostics for a limited time."""

import time

SHOWN = 1.5
"""Time for which a problem is current, s: longer than the period of diagnostics, 1 s, so that each problem appears there."""


class RecentProblem:
    """A problem with its diagnostics level, current for SHOWN after each report."""

    def __init__(self) -> None:
        self._level, self._text = b"", ""
        self._met_at = -SHOWN

    def report(self, level: bytes, text: str) -> None:
        """Record a problem that occurs now."""
        self._level, self._text, self._met_at = level, text, time.monotonic()

    @property
    def current(self) -> tuple[bytes, str] | None:
        """Level and text of the problem; None if it was reported more than SHOWN ago."""
        return (self._level, self._text) if time.monotonic() - self._met_at < SHOWN else None
