"""The black box of a node: its last messages, in bounded memory, written as a bag when an error occurs.

Messages are kept serialized: inputs are taken in that form and converted afterwards, and outputs are published in it.
The bag is written by a process of its own, which a thread feeds in short pieces: building it here would block the control period.
"""

import re
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import yaml
from rcl_interfaces.msg import Log
from rclpy.logging import get_logging_directory
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message

from vessel_hsmc_ros.bags.black_box_content import WRITER, header, record
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes.kept_logger import KeptLogger
from vessel_hsmc_ros.scenario.common_parameters import BlackBoxParameters
from vessel_hsmc_ros.scenario.parameters_file import tree

MEMORY = 32 * 1024 * 1024
"""Limit of the messages kept, bytes: a controller at 100 Hz needs 7 MB for 30 s."""

LEAST_INTERVAL, MOST_BAGS = 60.0, 10
"""Least time between two bags of a process, s, and the largest number of them."""

AFTERWARDS = 1.0
"""Time for which messages are still taken after an error, s, unless it ends the node."""

WRITE_LIMIT = 20.0
"""Longest time for writing a bag, s."""

PIECE = 256
"""Messages that are passed to the writing process at once."""


class BlackBox:
    """Keeps the last messages of a node, and writes them as a bag on request.

    Args:
        parameters: Time span and folder.
        stamp: Returns the time of a message that is kept now, ns.
    """

    def __init__(self, node: Node, parameters: BlackBoxParameters, stamp: Callable[[], int]) -> None:
        self._node, self._parameters, self._stamp = node, parameters, stamp
        self._span = round(parameters.duration * NANOSECONDS)
        self._kept: deque[tuple[int, bytes]] = deque()
        self._size = 0
        self._topics: dict[str, str] = {}
        self._numbers: dict[str, int] = {}
        self._last = -LEAST_INTERVAL
        self._bags = 0
        self._writing: threading.Thread | None = None
        self._ending = threading.Event()

    # -- messages -----------------------------------------------------------------------------------------------------

    def keep(self, topic: str, message: Any, data: bytes = b"") -> None:
        """Keep a message.

        Args:
            topic: Full name of its topic.
            data: Its serialized form, where that is known.
        """
        number = self._numbers.get(topic)
        if number is None:
            number = self._numbers[topic] = len(self._numbers)
            self._topics[topic] = _kind(type(message))
        entry = record(self._stamp(), number, data or serialize_message(message))
        if len(entry) > MEMORY:  # it would displace all others
            self._report_large(topic, len(entry))
            return
        now = time.monotonic_ns()  # the clock of the stamps may be set
        self._kept.append((now, entry))
        self._size += len(entry)
        while self._size > MEMORY or now - self._kept[0][0] > self._span:
            self._size -= len(self._kept.popleft()[1])

    def _report_large(self, topic: str, size: int) -> None:
        text = f"a message of {topic} must be at most {MEMORY / 1e6:.0f} MB for the black box (got {size / 1e6:.0f} MB): left out"
        self._node.get_logger().warning(text, once=True)

    def receiver(self, topic: str, kind: Any, callback: Callable[[Any], None]) -> Callable[[bytes], None]:
        """The callback of a raw subscription that converts each message, passes it on, and keeps it."""

        def receive(data: bytes) -> None:
            message = deserialize_message(data, kind)
            try:
                callback(message)
            finally:  # also a message that ends the node
                self.keep(topic, message, data)

        return receive

    def log(self, severity: int, name: str, text: str) -> None:
        """Keep a line of the node's log."""
        line = Log(level=severity, name=name, msg=text)
        line.stamp = conversions.time_message(self._node.get_clock().now().nanoseconds)
        self.keep("/rosout", line)

    # -- bags ---------------------------------------------------------------------------------------------------------

    def write(self, reason: str, ends: bool = False) -> None:
        """Write the messages as a bag, in the background; at most one in LEAST_INTERVAL, and MOST_BAGS in all.

        Args:
            reason: The error, in one line.
            ends: Whether the error ends the node: nothing further is taken.
        """
        if ends:
            self._ending.set()
        if time.monotonic() - self._last < LEAST_INTERVAL or self._bags >= MOST_BAGS or not self._kept:
            return
        self._last = time.monotonic()
        self._bags += 1
        self._writing = threading.Thread(target=self._write, args=(reason,), name="black box", daemon=True)
        self._writing.start()

    def close(self) -> None:
        """Wait until the bag that is being written is complete."""
        self._ending.set()
        if self._writing:
            self._writing.join(WRITE_LIMIT)

    def _write(self, reason: str) -> None:
        self._ending.wait(AFTERWARDS)
        kept = [entry for _, entry in self._kept.copy()]  # a copy is one step of the interpreter: the deque is not locked
        folders = [f"{folder}/{self._name()}" for folder in (self._directory(), Path(tempfile.gettempdir()) / "black_box")]
        parameters = {self._node.get_fully_qualified_name(): {"ros__parameters": self._document()}}
        notes = {"mode": "black box", "reason": reason, "messages_dropped": "0"}
        head = header(folders, notes, self._topics, yaml.safe_dump(parameters, sort_keys=False))
        try:
            done = _run(head, (b"".join(kept[i : i + PIECE]) for i in range(0, len(kept), PIECE)))
        except (OSError, subprocess.SubprocessError) as error:
            self._node.get_logger().error(f"the black box is not written: {error}")
            return
        if done.returncode:
            self._node.get_logger().error(f"the black box is not written: {done.stderr.decode(errors='replace').strip()}")
            return
        folder, _, refused = done.stdout.decode().strip().partition("\n")
        if refused:
            self._node.get_logger().warning(refused)
        self._node.get_logger().warning(f"{reason}: the black box is in {folder}")

    def _directory(self) -> Path:
        return Path(self._parameters.directory or get_logging_directory() / "black_box")

    def _name(self) -> str:
        name = re.sub(r"\W+", "_", self._node.get_fully_qualified_name().strip("/"))
        return f"{datetime.now(tz=timezone.utc):%Y%m%dT%H%M%S}_{name}_{self._bags}"

    def _document(self) -> dict[str, Any]:
        values = schema.flatten(self._node.parameters)  # type: ignore[attr-defined]
        return tree({name: list(value) if isinstance(value, tuple) else value for name, value in values.items()})


def installed(node: Any, parameters: BlackBoxParameters, stamp: Callable[[], int]) -> BlackBox | None:
    """The black box of a node, which its logger and its reporter fill too; None in lockstep and where it is turned off."""
    if node.parameters.lockstep or not parameters.duration:
        return None
    box = BlackBox(node, parameters, stamp)
    node._logger = KeptLogger(node.get_logger().name, box.log)  # rclpy has no other place for a logger of one's own
    node.reporter.keep = box.keep
    return box


def _kind(message_type: type) -> str:
    """Name of a message type, such as `nav_msgs/msg/Odometry`."""
    package, *_ = message_type.__module__.split(".")
    return f"{package}/msg/{message_type.__name__}"


def _run(head: bytes, pieces: Iterable[bytes]) -> "subprocess.CompletedProcess[bytes]":
    """Pass a content to the writing process, and wait for it."""
    command = [sys.executable, "-m", WRITER]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=True) as process:  # noqa: S603
        try:
            process.stdin.write(head)  # type: ignore[union-attr]
            for piece in pieces:
                process.stdin.write(piece)  # type: ignore[union-attr]
            output, errors = process.communicate(timeout=WRITE_LIMIT)
        except BaseException:
            process.kill()
            raise
    return subprocess.CompletedProcess(command, process.returncode, output, errors)
