"""Replay of a bag over ROS: the recorded bytes at the recorded rate or a multiple of it, with the clock of the recording."""

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool

from vessel_hsmc_ros.bags.reader import Bag
from vessel_hsmc_ros.bags.topic_columns import Series
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.raw import message_class
from vessel_hsmc_ros.nodes import qos

CLOCK_PERIOD = NANOSECONDS // 100  # period of the /clock that is published if the bag contains none, ns of recorded time
EARLIEST = 0.001  # how early a message may be published, s of wall time: a shorter wait costs more than it gains


@dataclass(frozen=True)
class Playing:
    """Options of a replay."""

    rate: float = 1.0  # playback speed relative to real time
    loop: bool = False  # whether to begin again at the end
    paused: bool = False  # whether to wait at the start until the service `~/pause` resumes
    topics: Sequence[str] = ()  # names of the topics to publish; all if empty


class ReplayNode(Node):
    """Publishes the messages of a bag; the service `~/pause` pauses and resumes."""

    def __init__(self, bag: Bag, playing: Playing, **options: Any) -> None:
        super().__init__("replay", **options)
        self.published = 0
        self.position = 0.0
        self.paused = playing.paused
        self._bag, self._playing = bag, playing
        chosen = [bag[name] for name in playing.topics] or list(bag.topics.values())
        self._outputs = {s.name: found for s in chosen if s.count and (found := self._publisher(s))}
        if not self._outputs:
            raise BagError(f"bag {bag.path} has no message that could be published")
        self._ticker = None if "/clock" in self._outputs else self.create_publisher(Clock, "/clock", qos.CLOCK)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self._began, self._from = 0.0, 0

    def play(self, running: Callable[[], bool]) -> None:
        """Publish everything, once or in a loop, until `running` returns False."""
        with SingleThreadedExecutor(context=self.context) as executor:
            executor.add_node(self)
            while running():
                self._play_once(executor, running)
                if not self._playing.loop:
                    return

    def _play_once(self, executor: SingleThreadedExecutor, running: Callable[[], bool]) -> None:
        """Publish each message at its log time, after the tick of /clock that precedes it."""
        tick = None
        for message in self._bag.ordered_messages(*self._outputs):
            if tick is None:
                tick = message.log_time
                self._start_from(tick)
            while self._ticker and tick <= message.log_time:
                self._wait(tick, executor, running)
                self._ticker.publish(Clock(clock=conversions.time_message(tick)))
                tick += CLOCK_PERIOD
            self._wait(message.log_time, executor, running)
            if not running():
                return
            self._outputs[message.topic].publish(message.data)
            self.published += 1
            self.position = seconds(message.log_time - self._bag.start_time)

    def _start_from(self, log_time: int) -> None:
        """Map a log time, ns, to the present wall time."""
        self._began, self._from = time.monotonic(), log_time

    def _wait(self, log_time: int, executor: SingleThreadedExecutor, running: Callable[[], bool]) -> None:
        """Wait until the wall time of a log time, and serve the pause service; a pause delays all later messages."""
        for turn in itertools.count():
            while self.paused and running():
                executor.spin_once(timeout_sec=0.05)
                self._start_from(log_time)
            rest = self._began + seconds(log_time - self._from) / self._playing.rate - time.monotonic()
            if rest < EARLIEST or not running():
                # Messages that follow each other without a wait must not keep the pause service from being served.
                if turn == 0 and self.published % 100 == 0:
                    executor.spin_once(timeout_sec=0.0)
                return
            executor.spin_once(timeout_sec=min(rest, 0.05))

    def _publisher(self, series: Series) -> Publisher | None:
        """A publisher of a topic's type and quality of service; None with a warning where there is no such type."""
        if series.others or series.encoding != "cdr" or not series.type:
            self.get_logger().warning(f"{series.name} is not published: it {series.undecodable}")
            return None
        try:
            kind = message_class(series.type)
        except (ImportError, AttributeError, ValueError):  # the last: a name of another form
            self.get_logger().warning(f"{series.name} is not published: {series.type} is not installed")
            return None
        return self.create_publisher(kind, series.name, qos.replayed(series.qos))

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self.paused = request.data
        response.success, response.message = True, "paused" if self.paused else "playing"
        return response
