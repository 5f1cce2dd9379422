"""A node whose callbacks a test calls itself, on a clock of the test: what it sends, and when, is exact."""

import math
from copy import deepcopy
from types import ModuleType
from typing import Any

import pytest
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from std_srvs.srv import Trigger

from vessel_hsmc_ros.messages import conversions as conv


class SteppedTime:
    """Stands for the module `time` of a node: a clock that only the test advances.

    Attributes:
        seconds: The present time, s.
    """

    def __init__(self) -> None:
        self.seconds = 1000.0

    def monotonic(self) -> float:
        """The present time, s."""
        return self.seconds

    time = monotonic

    def monotonic_ns(self) -> int:
        """The present time, ns."""
        return round(self.seconds * 1e9)


class SteppedNode:
    """A node that is connected, and that nothing but the test calls.

    Args:
        bench: Where it is started.
        monkeypatch: Restores what is replaced: the clocks of `modules` and of the node, and what it sends by.
        kind: Its class.
        modules: Those that look at the steady clock.
        parameters: Of the node.

    Attributes:
        node: The node.
        time: Its clock.
        sent: What it has published: the topic without slash, and the message.
        last: The last good command of `command_of`.
    """

    def __init__(
        self, bench: Any, monkeypatch: pytest.MonkeyPatch, kind: Any, modules: tuple[ModuleType, ...], **parameters: Any
    ) -> None:
        self.time = SteppedTime()
        self.sent: list[tuple[str, Any]] = []
        self.last: Any = None
        for module in modules:
            monkeypatch.setattr(module, "time", self.time)
        self.node = bench.start(kind, **{"lockstep": False, **parameters})
        self.node.connected = True
        monkeypatch.setattr(self.node, "now", self.time.monotonic_ns)
        monkeypatch.setattr(self.node, "send", self._note)

    def _note(self, publisher: Any, message: Any) -> None:
        if isinstance(message, bytes):
            message = deserialize_message(message, publisher.msg_type)
        self.sent.append((publisher.topic_name[1:], deepcopy(message)))  # nodes fill in the same message again

    def change(self, **values: Any) -> None:
        """Change parameters of the node as a request of another node does."""
        result = self.node.set_parameters_atomically([Parameter(name, value=value) for name, value in values.items()])
        assert result.successful, result.reason

    def stop(self, rearm: bool = False) -> None:
        """Call the service `~/stop` of a node that has a latch, or `~/rearm`."""
        serve = self.node._latch._rearm if rearm else self.node._latch._stop
        assert serve(Trigger.Request(), Trigger.Response()).success

    def wait(self, seconds: float) -> None:
        """Let time pass, s, in which the node is not called."""
        self.time.seconds += seconds

    def stamped(self, message: Any, late: float = 0.0) -> Any:
        """The message with the present stamp, or one that is late, s."""
        message.header.stamp = conv.time_message(self.time.monotonic_ns() - round(late * 1e9))
        return message

    def command_of(self, kind: str, force: float, moment: float) -> Any:
        """A wrench that is good, or one of which its kind names what is wrong; the last one again where it is repeated."""
        if kind == "repeated":
            return self.last or self.wrench(force, moment, 60.0)
        late = {"old": 5.0, "future": -5.0}.get(kind, 0.0)
        message = self.wrench(math.nan if kind == "nan" else force, moment, late)
        message.header.frame_id = "map" if kind == "frame" else message.header.frame_id
        if kind == "good":
            self.last = message
        return message

    def wrench(self, force: float, moment: float, late: float = 0.0) -> Any:
        """A wrench of the present time, N and N·m, or one that is late, s."""
        message = conv.new_wrench()
        conv.write_wrench(message, conv.time_message(self.time.monotonic_ns() - round(late * 1e9)), (force, moment))
        return message
