"""The sign of another plant in the same ROS domain, before the ROS graph shows it.

On a busy machine the graph may show a plant a second late that its topic has a publisher already. In lockstep no command comes
before a plant's first step; one that comes all the same answers another plant, whose run a first step would disturb.
"""

import time
from typing import Any

LISTENING = 0.04
"""Time for which a plant listens once it is connected, s: two of its checks, between which it receives messages."""

SILENCE = 2.0
"""Time without a command after which the other loop counts as ended, s; the graph shows its plant sooner."""


class OtherLoop:
    """Shows whether another plant is being answered.

    Args:
        drive: Receives the commands of this plant.
    """

    def __init__(self, drive: Any) -> None:
        self._drive = drive
        self._since = 0.0

    def sign(self) -> str:
        """What a connected plant waits for before its first step; empty when it may begin."""
        now = time.monotonic()
        self._since = self._since or now
        if self._drive.heard_at:
            silent = now - self._drive.heard_at >= SILENCE
            return "" if silent else f"the end of another run, whose commands come on {' and '.join(self._drive.topics)}"
        return "" if now - self._since >= LISTENING else "a check that no other run uses this ROS domain"
