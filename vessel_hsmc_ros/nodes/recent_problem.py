"""The problem that a node met last, kept in its diagnostics for a while after it was last met."""

import time

SHOWN = 1.5
"""Time that a problem stays current, s: above the second between two diagnostics messages, so that none is missed there."""


class RecentProblem:
    """A problem with its diagnostics level, current for SHOWN after each report."""

    def __init__(self) -> None:
        self._level, self._text = b"", ""
        self._met_at = -SHOWN

    def report(self, level: bytes, text: str) -> None:
        """Note a problem and that it is met now."""
        self._level, self._text, self._met_at = level, text, time.monotonic()

    @property
    def current(self) -> tuple[bytes, str] | None:
        """Level and text of the problem; None when it was met too long ago."""
        return (self._level, self._text) if time.monotonic() - self._met_at < SHOWN else None
