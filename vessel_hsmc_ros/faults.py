"""Scripted faults as pure functions: what a fault is, which settings each kind takes, and what it does to messages."""

import hashlib
import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.node_list import PLANT, RECORDER
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.timing import NANOSECONDS

WRENCH = "cmd_wrench"
TOPICS = ("odom", "reference", WRENCH)
"""The topics of every run that pass through the relay; where thrusters drive the ship, so do their demands."""

THRUSTERS = "thrusters/"

CHANGES = ("nan", "inf", "huge", "bit_flip", "add")
"""How a field is corrupted: by a value, by one flipped bit of its 64, or by an offset."""


class Kind(NamedTuple):
    """A kind of fault."""

    target: str  # what it acts on: topic, actuator, node or clock
    meaning: str  # what it does, for the documentation
    takes: tuple[str, ...] = ()  # the settings that it takes besides at, its target and, where it ends, duration
    needs: tuple[str, ...] = ()  # those of them that have no default
    lockstep: bool = True  # whether it can be carried out in lockstep
    ends: bool = True  # whether it can end before the run does, so that it takes a duration


_NOT_IN_LOCKSTEP = False

KINDS = {
    "drop": Kind("topic", "messages are lost", ("probability",)),
    "delay": Kind(
        "topic", "messages come late, by `delay` and up to `jitter` more", ("probability", "delay", "jitter"), ("delay",)
    ),
    "duplicate": Kind("topic", "messages come twice", ("probability",)),
    "reorder": Kind("topic", "a message comes after the one that follows it", ("probability",)),
    "corrupt": Kind("topic", "a field of the message is wrong", ("probability", "field", "change", "amount"), ("field",)),
    "freeze": Kind("topic", "the content of the last message comes again and again, with fresh stamps"),
    "lose_position": Kind(
        "topic", "the position of `odom` is lost: NaN, while heading and velocities are still measured", ("probability",)
    ),
    "offset": Kind("topic", "stamps are off by `offset`", ("probability", "offset"), ("offset",)),
    "frame": Kind("topic", "messages are in another frame", ("probability", "frame"), ("frame",)),
    "lose": Kind("actuator", "an actuator does nothing", ("component",)),
    "weaken": Kind("actuator", "an actuator gives `factor` of what is demanded", ("component", "factor"), ("factor",)),
    "reverse": Kind("actuator", "an actuator acts in the opposite direction", ("component",)),
    "kill": Kind("node", "its process is killed (SIGKILL), for good", lockstep=_NOT_IN_LOCKSTEP, ends=False),
    "stop": Kind("node", "its process is suspended (SIGSTOP) for `duration`", lockstep=_NOT_IN_LOCKSTEP),
    "restart": Kind("node", "its process is killed, and started again after `duration`", lockstep=_NOT_IN_LOCKSTEP),
    "clock_step": Kind(
        "clock", "the clock of a node, of all nodes by default, is off by `offset`", ("offset",), ("offset",), _NOT_IN_LOCKSTEP
    ),
    "second_publisher": Kind("topic", "another node publishes the topic as well", ("amount",), lockstep=_NOT_IN_LOCKSTEP),
    "mismatched_qos": Kind(
        "topic", "another node reads it with a durability that no node of the loop offers", lockstep=_NOT_IN_LOCKSTEP
    ),
}
"""Every kind of fault by its name."""

_TARGETS = {"topic": ("topic",), "actuator": ("topic",), "node": ("node",), "clock": ("node",)}


@dataclass(frozen=True)
class Fault:
    """One fault of a script."""

    at: float = parameter(0.0, "Time since the first odometry at which it begins.", unit="s", low=0.0, high=1e6)
    duration: float = parameter(0.0, "How long it lasts; 0 means to the end of the run.", unit="s", low=0.0, high=1e6)
    kind: str = parameter("drop", "What happens.", choices=tuple(KINDS))
    topic: str = parameter("", "The topic, of a fault that acts on messages or actuators.")
    node: str = parameter("", "The node, of a fault that acts on a process or on its clock.")
    probability: float = parameter(1.0, "Share of the messages that it hits, at random.", low=0.0, high=1.0)
    delay: float = parameter(0.0, "By how much messages are late.", unit="s", low=0.0, high=1e4)
    jitter: float = parameter(0.0, "Largest random addition to the delay.", unit="s", low=0.0, high=1e4)
    field: str = parameter("", "The field that is corrupted, such as pose.pose.position.x.")
    change: str = parameter("nan", "How it is corrupted.", choices=CHANGES)
    amount: float = parameter(
        0.0,
        "What `add` adds to the field; the surge force, or the thrust, that a second publisher commands.",
        low=-1e12,
        high=1e12,
    )
    frame: str = parameter("", "The frame in which the messages are.")
    offset: float = parameter(
        0.0, "By how much stamps or the clock are off; below 0 they are late.", unit="s", low=-1e6, high=1e6
    )
    factor: float = parameter(1.0, "Share of the demand that a weakened actuator gives.", low=-10.0, high=10.0)
    component: str = parameter("both", "The actuator of cmd_wrench.", choices=("surge", "yaw", "both"))

    @property
    def begin(self) -> int:
        """Time at which it begins, ns."""
        return round(self.at * NANOSECONDS)

    @property
    def end(self) -> float:
        """Time at which it is over, ns; infinite for one that lasts to the end."""
        return self.begin + round(self.duration * NANOSECONDS) if self.duration else math.inf

    def active(self, elapsed: int) -> bool:
        """Whether it acts at a time since the first odometry, ns."""
        return self.begin <= elapsed < self.end

    def describe(self) -> str:
        """The fault in a few words, as events name it."""
        target = f" of {self.topic or self.node or 'all nodes'}"
        kind = KINDS[self.kind]
        values = [f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}" for name, value in self._set(kind)]
        return f"{self.kind}{target}{f' ({chr(44).join(values)})' if values else ''}".replace(",", ", ")

    def _set(self, kind: Kind) -> list[tuple[str, object]]:
        default = Fault()
        return [(name, getattr(self, name)) for name in kind.takes if getattr(self, name) != getattr(default, name)]


@dataclass(frozen=True)
class FaultScript:
    """The faults of a run in the order of the script, and the seed of what is random in them."""

    faults: tuple[Fault, ...] = ()
    seed: int = 0


def check_settings(fault: Fault, given: Collection[str], owner: str) -> None:
    """Check that a fault has the settings of its kind and no others."""
    kind = KINDS[fault.kind]
    target = _TARGETS[kind.target]
    allowed = ("at", *(("duration",) if kind.ends else ()), "kind", *target, *kind.takes)
    needed = ["at", "kind", *kind.needs, *(() if kind.target == "clock" else target)]
    needed += ["duration"] if fault.kind in ("stop", "restart") else []
    for name in needed:
        if name not in given:
            raise ParameterError(f"{owner} has no {name}: a fault of kind {fault.kind} needs it")
    for name in given:
        if name not in allowed:
            raise ParameterError(f"{owner}.{name} does not apply to kind {fault.kind}, which has {', '.join(allowed)}")


def check_target(fault: Fault, topics: Collection[str], nodes: Collection[str], owner: str) -> None:
    """Check that the run has the topic or the node of a fault."""
    target = KINDS[fault.kind].target
    if target in ("topic", "actuator") and fault.topic not in topics:
        raise ParameterError(f"{owner}.topic must be one of {', '.join(topics)} (got {fault.topic})")
    if target in ("node", "clock") and fault.node not in nodes and (fault.node or target == "node"):
        raise ParameterError(f"{owner}.node must be one of {', '.join(nodes)} (got {fault.node})")
    if target == "actuator" and fault.topic in ("odom", "reference"):
        actuators = ", ".join(topic for topic in topics if topic not in ("odom", "reference"))
        raise ParameterError(f"{owner}.topic must be an actuator, one of {actuators} (got {fault.topic})")
    if fault.kind == "lose_position" and fault.topic != "odom":
        raise ParameterError(f"{owner}.topic must be odom for kind lose_position (got {fault.topic})")
    if fault.kind == "restart" and fault.node == RECORDER:
        raise ParameterError(f"{owner}.node must not be recorder: a second recorder would overwrite the bag")
    if fault.kind == "kill" and fault.node == PLANT:
        raise ParameterError(f"{owner}.node must not be vessel_sim: the plant ends the run; restart brings it back")
    if fault.topic.startswith(THRUSTERS) and fault.kind in ("offset", "frame"):
        raise ParameterError(f"{owner}.kind = {fault.kind} needs a header, which messages of {fault.topic} do not have")


def check_mode(fault: Fault, lockstep: bool, owner: str) -> None:
    """Check that a fault can be carried out in the mode of the run. Raises ParameterError if it cannot."""
    if not lockstep:
        return
    if not KINDS[fault.kind].lockstep:
        raise ParameterError(
            f"{owner}.kind = {fault.kind} is not possible in lockstep, where time waits for every node: --real-time"
        )
    if fault.topic.startswith(THRUSTERS) and fault.kind in ("duplicate", "reorder"):
        raise ParameterError(f"{owner}.kind = {fault.kind} is not possible in lockstep on {fault.topic}: it needs --real-time")


FACTORS = {"lose": 0.0, "reverse": -1.0}
"""Share of the demand that a faulty actuator gives; that of a weakened one is its setting."""

FIELDS = {"surge": ("wrench.force.x",), "yaw": ("wrench.torque.z",), "both": ("wrench.force.x", "wrench.torque.z")}
"""The fields of cmd_wrench by their actuator."""

POSITION = ("pose.pose.position.x", "pose.pose.position.y")  # the fields of odom that a lost position leaves without a value
THRUSTER_FIELD = "data"


def draw(seed: int, fault: int, topic: str, number: int, purpose: str) -> float:
    """A number uniform in [0, 1). `number`: sequence number of the message on its topic."""
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
