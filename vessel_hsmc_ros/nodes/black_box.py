"""The black box of a node: its last messages, in bounded memory, written as a bag when an error occurs.

Messages are kept serialized: inputs are taken in that form and converted afterwards, and outputs are published in it.
The bag is written by a process of its own, which a thread feeds message by message: building it here would block the control
period.
"""

import pickle
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from typing import Any

import yaml
from rcl_interfaces.msg import Log
from rclpy.logging import LoggingSeverity, get_logging_directory
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message

from vessel_hsmc_ros.bags.black_box import WRITER, Head, Message
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import conversions, raw
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.scenario.parameter_groups import BlackBoxParameters
from vessel_hsmc_ros.scenario.parameters_file import tree

MEMORY = 32 * 1024 * 1024  # limit of the messages kept, bytes: a controller at 100 Hz needs 7 MB for 30 s
LEAST_INTERVAL, MOST_BAGS = 60.0, 10  # least time between two bags of a process, s, and the largest number of them
AFTERWARDS = 1.0  # time for which messages are still taken after an error, s, unless it ends the node
WRITE_LIMIT = 20.0  # longest time for writing a bag, s


class BlackBox:
    """Keeps the last messages of a node, and writes them as a bag on request; `stamp` returns the time of a message, ns."""

    def __init__(self, node: Node, parameters: BlackBoxParameters, stamp: Callable[[], int]) -> None:
        self._node, self._parameters, self._stamp = node, parameters, stamp
        self._span = round(parameters.duration * NANOSECONDS)
        self._kept: deque[tuple[int, Message]] = deque()
        self._size = 0
        self._last = -LEAST_INTERVAL
        self._bags = 0
        self._writing: threading.Thread | None = None
        self._ending = threading.Event()

    def keep(self, topic: str, message: Any, data: bytes = b"") -> None:
        """Keep a message of a topic, given by its full name; `data` is its serialized form, where that is known."""
        data = data or serialize_message(message)
        if len(data) > MEMORY:  # it would displace all others
            text = f"a message of {topic} must be at most {MEMORY / 1e6:.0f} MB for the black box (got {len(data) / 1e6:.0f} MB)"
            self._node.get_logger().warning(f"{text}: left out", once=True)
            return
        now = time.monotonic_ns()  # the clock of the stamps may be set
        self._kept.append((now, (self._stamp(), topic, raw.type_name(type(message)), data)))
        self._size += len(data)
        while self._size > MEMORY or now - self._kept[0][0] > self._span:
            self._size -= len(self._kept.popleft()[1][-1])

    def receiver(self, topic: str, kind: Any, callback: Callable[[Any], None]) -> Callable[[bytes], None]:
        """The callback of a raw subscription that converts each message, passes it on, and keeps it."""

        def receive(data: bytes) -> None:
            message = deserialize_message(data, kind)
            try:
                callback(message)
            finally:  # also a message that ends the node
                self.keep(topic, message, data)

        return receive

    def keep_log(self, line: Log) -> None:
        """Keep a line of the node's own log."""
        if line.name == self._node.get_logger().name:
            self.keep("/rosout", line)

    def write(self, reason: str, ends: bool = False) -> None:
        """Write the messages as a bag, in the background; at most one in LEAST_INTERVAL, and MOST_BAGS in all.

        After an error that ends the node nothing further is taken.
        """
        if ends:
            line = Log(level=int(LoggingSeverity.FATAL), name=self._node.get_logger().name, msg=reason)
            line.stamp = conversions.time_message(self._node.get_clock().now().nanoseconds)
            self.keep_log(line)  # /rosout would bring it too late
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
        kept = [message for _, message in self._kept.copy()]  # a copy is one step of the interpreter: the deque is not locked
        try:
            done = _run(self._head(reason), kept)
            failure = (done.stderr.decode(errors="replace").strip() or "its process ended") if done.returncode else ""
        except (OSError, subprocess.SubprocessError) as error:
            failure = str(error)
        if failure:
            self._node.get_logger().error(f"the black box is not written: {failure}")
            return
        folder, _, refused = done.stdout.decode().strip().partition("\n")
        if refused:
            self._node.get_logger().warning(refused)
        self._node.get_logger().warning(f"{reason}: the black box is in {folder}")

    def _head(self, reason: str) -> Head:
        """What the bag has besides messages, and where it may be written: the second folder is for a disk that is full."""
        node = self._node.get_fully_qualified_name()
        values = schema.flatten(self._node.parameters)  # type: ignore[attr-defined]
        listed = {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}
        parameters = yaml.safe_dump({node: {"ros__parameters": tree(listed)}}, sort_keys=False)
        name = f"{datetime.now(tz=timezone.utc):%Y%m%dT%H%M%S}_{re.sub(r'[^0-9A-Za-z_]+', '_', node.strip('/'))}_{self._bags}"
        wanted = self._parameters.directory or f"{get_logging_directory()}/black_box"
        folders = [f"{wanted}/{name}", f"{tempfile.gettempdir()}/black_box/{name}"]
        return Head(folders, {"mode": "black box", "reason": reason, "messages_dropped": "0"}, parameters)


def installed(node: Any, parameters: BlackBoxParameters, stamp: Callable[[], int]) -> BlackBox | None:
    """The black box of a node, which its log and its reporter fill too; None in lockstep and where it is turned off."""
    if node.parameters.lockstep or not parameters.duration:
        return None
    box = BlackBox(node, parameters, stamp)
    node.create_subscription(Log, "/rosout", box.keep_log, qos.WATCHED)
    node.reporter.keep = box.keep
    return box


def _run(head: Head, messages: Sequence[Message]) -> "subprocess.CompletedProcess[bytes]":
    """Pass a content to the writing process, and wait for it."""
    command = [sys.executable, "-m", WRITER]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=True) as process:  # noqa: S603
        try:
            for part in (head, *messages):
                pickle.dump(part, process.stdin)  # type: ignore[arg-type]
            output, errors = process.communicate(timeout=WRITE_LIMIT)
        except BaseException:
            process.kill()
            raise
    return subprocess.CompletedProcess(command, process.returncode, output, errors)
