"""What a script makes of the messages of one topic: which are delivered, when, and with which changes."""

import hashlib
import math
from functools import partial
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.faults.fault import THRUSTERS, Fault, FaultScript

FACTORS = {"lose": 0.0, "reverse": -1.0}
"""Share of the demand that a faulty actuator gives; that of a weakened one is its setting."""

FIELDS = {"surge": ("wrench.force.x",), "yaw": ("wrench.torque.z",), "both": ("wrench.force.x", "wrench.torque.z")}
"""The fields of cmd_wrench by their actuator."""

POSITION = ("pose.pose.position.x", "pose.pose.position.y")  # the fields of odom that a lost position leaves without a value
THRUSTER_FIELD = "data"


def draw(seed: int, fault: int, topic: str, number: int, purpose: str) -> float:
    """A number uniform in [0, 1).

    `number`: sequence number of the message on its topic.
    """
    text = f"{seed} {fault} {topic} {number} {purpose}".encode()
    return int.from_bytes(hashlib.blake2b(text, digest_size=8).digest(), "big") / 2.0**64


class Edit(NamedTuple):
    """A change of one field of a message: set, add, scale or flip, by a value; of `flip` the index of the bit, 0 the lowest."""

    field: str
    change: str
    value: Any


class Delivery(NamedTuple):
    """A message on its way."""

    message: Any  # as it was received
    number: int  # sequence number of the message in whose place it comes, from 0
    stamp: int  # the stamp that it comes with, ns
    due: int  # time at which it is delivered, ns
    edits: tuple[Edit, ...] = ()  # changes of its content
    held: bool = False  # whether it waits for the next message of its topic


class TopicSchedule:
    """The faults of one topic, applied in the order of the script.

    Attributes:
        number: Sequence number of the latest message, from 0; -1 before the first.
    """

    def __init__(self, script: FaultScript, topic: str) -> None:
        self._topic, self._seed = topic, script.seed
        self._faults = [(index, fault) for index, fault in enumerate(script.faults) if fault.topic == topic]
        self._frozen: dict[int, Any] = {}
        self._pending: list[Delivery] = []
        self._held: list[Delivery] = []
        self.number = -1

    def take(self, message: Any, stamp: int, elapsed: int) -> list[Delivery]:
        """Take the next message of the topic and return what is delivered now, in this order.

        `stamp`: its stamp, ns. `elapsed`: the present time since the start of the run, ns, by which faults begin and end.
        """
        self.number += 1
        deliveries = [Delivery(message, self.number, stamp, elapsed)]
        for index, fault in self._faults:
            stage = partial(self._apply, index, fault, message, elapsed)
            deliveries = [made for delivery in deliveries for made in stage(delivery)]
        now = [delivery for delivery in deliveries if delivery.due <= elapsed]
        self._pending += [delivery for delivery in deliveries if delivery.due > elapsed]
        held, self._held = self._held, [delivery for delivery in now if delivery.held]
        due = self.due(elapsed)
        return [*due, *(delivery for delivery in now if not delivery.held), *held]

    def due(self, elapsed: int) -> list[Delivery]:
        """The delayed messages whose time has come, in the order of their times."""
        found = sorted((d for d in self._pending if d.due <= elapsed), key=lambda d: d.due)
        self._pending = [d for d in self._pending if d.due > elapsed]
        return found

    def current(self, delivery: Delivery, stamp: int) -> bool:
        """Whether a delivery is that of the latest message, with its own stamp, so that a receiver knows it for the present."""
        return delivery.number == self.number and delivery.stamp == stamp

    def _apply(self, index: int, fault: Fault, message: Any, elapsed: int, delivery: Delivery) -> list[Delivery]:
        """What one fault makes of one delivery."""
        if not fault.active(elapsed):
            if fault.kind == "freeze":
                self._frozen[index] = message
            return [delivery]
        if fault.kind == "freeze":
            return [delivery._replace(message=self._frozen.get(index, message))]
        if fault.probability < 1.0 and self._draw(index, "hit") >= fault.probability:
            return [delivery]
        return self._hit(index, fault, delivery)

    def _hit(self, index: int, fault: Fault, delivery: Delivery) -> list[Delivery]:
        if fault.kind == "drop":
            return []
        if fault.kind == "duplicate":
            return [delivery, delivery]
        if fault.kind == "reorder":
            return [delivery._replace(held=True)]
        if fault.kind == "delay":
            late = fault.delay + (fault.jitter * self._draw(index, "jitter") if fault.jitter else 0.0)
            return [delivery._replace(due=delivery.due + round(late * NANOSECONDS))]
        if fault.kind == "offset":
            return [delivery._replace(stamp=max(0, delivery.stamp + round(fault.offset * NANOSECONDS)))]
        return [delivery._replace(edits=(*delivery.edits, *self._edits(index, fault)))]

    def _edits(self, index: int, fault: Fault) -> tuple[Edit, ...]:
        """The changes of the content by a fault that corrupts it, or that acts on an actuator; none by other faults."""
        if fault.kind == "frame":
            return (Edit("header.frame_id", "set", fault.frame),)
        if fault.kind == "lose_position":
            return tuple(Edit(field, "set", math.nan) for field in POSITION)
        if fault.kind == "corrupt":
            return (self._corruption(index, fault),)
        if fault.kind in ("lose", "weaken", "reverse"):
            factor = FACTORS.get(fault.kind, fault.factor)
            fields = (THRUSTER_FIELD,) if fault.topic.startswith(THRUSTERS) else FIELDS[fault.component]
            return tuple(Edit(field, "scale", factor) for field in fields)
        return ()

    def _corruption(self, index: int, fault: Fault) -> Edit:
        if fault.change == "bit_flip":
            return Edit(fault.field, "flip", int(64 * self._draw(index, "bit")))
        if fault.change == "add":
            return Edit(fault.field, "add", fault.amount)
        return Edit(fault.field, "set", {"nan": math.nan, "inf": math.inf, "huge": 1e30}[fault.change])

    def _draw(self, index: int, purpose: str) -> float:
        return draw(self._seed, index, self._topic, self.number, purpose)
