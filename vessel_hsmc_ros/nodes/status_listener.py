"""Subscription to the diagnostics of a run's nodes: their progress, and evidence that they are alive."""

import time
from collections.abc import Callable, Iterable

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.core.install_paths import discovery
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.nodes import qos

RESTART_LIMIT = 15.0  # time for a node that is started again to report, s


class StatusListener:
    """Collects the latest diagnostics of each node in a namespace, on a ROS context of its own.

    `namespace`: the nodes' namespace, without slashes at its ends. `vessels`: namespaces of the vessels of a fleet, whose nodes
    are named such as `vessel_2/controller`.

    Attributes:
        status: The latest diagnostics values of each node.
        heard_at: Time of the latest status of each node, on the monotonic clock, s.
    """

    created = False  # whether this process has had one, and so the middleware

    def __init__(self, namespace: str = "", vessels: Iterable[str] = ()) -> None:
        StatusListener.created = True
        self._vessels = tuple(f"{vessel}/" for vessel in vessels)
        self._prefix = f"{namespace}/" if namespace else ""
        self.status: dict[str, dict[str, str]] = {}
        self.heard_at: dict[str, float] = {}
        # No signal handlers: rclpy's would end this context at Ctrl-C, before the nodes have reported their shutdown.
        self._context = rclpy.Context()
        rclpy.init(context=self._context, args=[], signal_handler_options=SignalHandlerOptions.NO)
        with discovery():
            self._node = rclpy.create_node("run_monitor", context=self._context, start_parameter_services=False)
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_status, qos.DIAGNOSTICS)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def __enter__(self) -> "StatusListener":
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)

    def listen(self, seconds: float) -> None:
        """Wait at most a time, s, for a message, and process it."""
        self._executor.spin_once(timeout_sec=seconds)

    def on_fault(self, act: Callable[[str], str]) -> None:
        """Call a function with the text of each event of a scripted fault; a node that it names is heard of at that time."""

        def on_event(message: Event) -> None:
            if message.kind == "fault" and (back := act(message.text)):
                self.heard_at[back] = time.monotonic() + RESTART_LIMIT

        self._node.create_subscription(Event, f"/{self._prefix}{EVENTS}", on_event, qos.EVENTS)

    def _on_status(self, message: DiagnosticArray) -> None:
        latest = conversions.read_status(message, self._prefix)
        for vessel in self._vessels:
            latest |= {f"{vessel}{node}": status for node, status in conversions.read_status(message, vessel).items()}
        self.status.update(latest)
        self.heard_at.update(dict.fromkeys(latest, time.monotonic()))
