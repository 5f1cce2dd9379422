"""The black box of a node: its last messages, serialised and in bounded memory, written as a bag when an error occurs.

A process of its own writes the bag, fed by a thread: the node would delay its control period.
"""

import pickle
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path
from shutil import rmtree
from typing import Any, BinaryIO

from rcl_interfaces.msg import Log
from rclpy.logging import LoggingSeverity, get_logging_directory
from rclpy.node import Node
from rclpy.serialization import serialize_message

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import conversions, raw
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.scenario.parameter_groups import BlackBoxParameters
from vessel_hsmc_ros.scenario.parameters_file import tree, yaml_text

MEMORY = 32 * 1024 * 1024  # limit of the messages kept, bytes: a controller at 100 Hz needs 7 MB for 30 s
LEAST_INTERVAL, MOST_BAGS = 60.0, 10  # least time between two bags of a process, s, and the largest number of them
AFTERWARDS = 1.0  # time for which messages are still taken after an error, s, unless it ends the node
WRITE_LIMIT = 20.0  # longest time for writing a bag, s
COMMAND = ("nice", sys.executable, "-m", "vessel_hsmc_ros.nodes.black_box")  # the writing process


class BlackBox:
    """Keeps the last messages of a node, and writes them as a bag on request; `stamp` returns the time of a message, ns."""

    def __init__(self, node: Node, parameters: BlackBoxParameters, stamp: Callable[[], int]) -> None:
        self._node, self._directory, self._stamp = node, parameters.directory, stamp
        self._span = round(parameters.duration * NANOSECONDS)
        self._kept: deque[tuple[int, tuple[int, str, str, bytes]]] = deque()
        self._size = self._bags = 0
        self._last = -LEAST_INTERVAL
        self._writing: threading.Thread | None = None
        self._ending = threading.Event()

    def keep(self, topic: str, message: Any, data: bytes = b"") -> None:
        """Keep a message of a topic, given by its full name; where `data`, its serialised form, is known, its type suffices."""
        kind = raw.type_name(message if isinstance(message, type) else type(message))
        data = data or serialize_message(message)
        if len(data) > MEMORY:  # it would displace all others
            self._node.get_logger().warning(f"a message of {topic} is too large for the black box: left out", once=True)
            return
        now = time.monotonic_ns()  # the clock of the stamps may be set
        self._kept.append((now, (self._stamp(), topic, kind, data)))
        self._size += len(data)
        while self._size > MEMORY or now - self._kept[0][0] > self._span:
            self._size -= len(self._kept.popleft()[1][-1])

    def receiver(self, topic: str, kind: type, callback: Callable[[bytes], None]) -> Callable[[bytes], None]:
        """The callback of a raw subscription that passes each message on, and keeps it."""

        def receive(data: bytes) -> None:
            self.keep(topic, kind, data)  # first: also a message that ends the node
            callback(data)

        return receive

    def keep_log(self, line: Log) -> None:
        """Keep a line of the node's own log."""
        if line.name == self._node.get_logger().name:
            self.keep("/rosout", line)

    def write(self, reason: str, ends: bool = False) -> None:
        """Write the messages as a bag, in the background; after an error that ends the node nothing further is taken."""
        if ends:
            stamp = conversions.time_message(self._node.get_clock().now().nanoseconds)
            self.keep_log(  # /rosout would bring it too late
                Log(stamp=stamp, level=int(LoggingSeverity.FATAL), name=self._node.get_logger().name, msg=reason)
            )
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
        node, log = self._node.get_fully_qualified_name(), self._node.get_logger()
        name = f"{datetime.now(tz=timezone.utc):%Y%m%dT%H%M%S}{node.replace('/', '_')}"
        folder = f"{self._directory or f'{get_logging_directory()}/black_box'}/{name}"
        values = tree(schema.flatten(self._node.parameters))  # type: ignore[attr-defined]
        parameters = yaml_text({node: {"ros__parameters": values}})
        content = b"".join(map(pickle.dumps, [(folder, reason, parameters), *kept]))
        try:
            subprocess.run(  # noqa: S603
                COMMAND, input=content, stderr=subprocess.PIPE, timeout=WRITE_LIMIT, start_new_session=True, check=True
            )
        except (OSError, subprocess.SubprocessError) as error:
            why = getattr(error, "stderr", None) or str(error).encode()
            log.error(f"the black box is not written: {why.decode(errors='replace').strip()}")
        else:
            log.warning(f"{reason}: the black box is in {folder}")


def installed(node: Any, parameters: BlackBoxParameters, stamp: Callable[[], int]) -> BlackBox | None:
    """The black box of a node, which its log and its reporter fill too; None in lockstep and where it is turned off."""
    if node.parameters.lockstep or not parameters.duration:
        return None
    box = BlackBox(node, parameters, stamp)
    node.create_subscription(Log, "/rosout", box.keep_log, qos.WATCHED)
    node.reporter.keep = box.keep
    return box


def write(content: BinaryIO) -> None:
    """Write the bag of a content, without a message that is cut off as the node was killed; where that fails nothing is left."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    from vessel_hsmc_ros.bags.writer import PARAMETERS, BagWriter, Topic, qos_entry
    from vessel_hsmc_ros.messages.topics import definition

    folder, reason, parameters = pickle.load(content)  # noqa: S301 - of the node that has started this process
    writer = BagWriter(Path(folder), notes={"mode": "black box", "reason": reason, "messages_dropped": "0"})
    topics: dict[str, Topic] = {}
    try:
        writer.attach(PARAMETERS, parameters)
        with suppress(EOFError, pickle.UnpicklingError):
            while True:
                stamp, name, kind, data = pickle.load(content)  # noqa: S301
                if name not in topics:
                    text, store = definition(kind), get_typestore(Stores.EMPTY)
                    store.register(get_types_from_msg(text, kind))
                    topics[name] = Topic(name, kind, text, store.hash_rihs01(kind), [qos_entry(True, False)])
                    writer.add_topic(topics[name])
                writer.write(topics[name], data, stamp, stamp)
        writer.close()
    except BagError:
        rmtree(folder, ignore_errors=True)
        raise


if __name__ == "__main__":
    try:
        write(sys.stdin.buffer)
    except BagError as error:
        sys.exit(str(error))
