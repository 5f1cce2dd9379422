"""What the MAVLink node sends by its connection, noted in the place of one."""

from typing import Any, ClassVar

import pytest


class Recording:
    """Stands for the connection: gives the messages that a test has put in, and notes what is sent."""

    made: ClassVar[list["Recording"]] = []

    def __init__(self, *_: Any) -> None:
        self.target, self.broken, self.waiting, self.sent = 1, "", [], []
        Recording.made.append(self)

    waiting: list[Any]
    sent: list[tuple[Any, ...]]

    def receive(self) -> list[Any]:
        waiting, self.waiting = self.waiting, []
        return waiting

    def manual(self, y: int, z: int) -> None:
        self.sent.append(("manual", y, z))

    def override(self, channels: dict[int, int]) -> None:
        self.sent.append(("override", channels))

    def velocity(self, speed: float, yaw_rate: float) -> None:
        self.sent.append(("velocity", pytest.approx(speed), pytest.approx(yaw_rate)))

    def request_parameter(self, name: str) -> None:
        """Nothing comes, and it is no command."""

    def request(self, *_: Any) -> None:
        """Nothing comes."""

    def close(self) -> None:
        """Nothing is open."""
