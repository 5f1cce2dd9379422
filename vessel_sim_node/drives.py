"""What a plant waits for before a step: its command, a wrench or the demands of its thrusters, and the other plants of a fleet.

A fleet in lockstep has a barrier: one plant owns /clock, and no vessel takes a step before all have finished the last one. The
owner reads `applied_wrench` of every follower, which each publishes when it has finished a step, and publishes the next tick of
/clock when all of them, and it itself, are done. A follower takes its next step when it has received that tick. /clock is
latched, so a follower that connects late still receives the tick that it waits for.
"""

import math
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from geometry_msgs.msg import WrenchStamped
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.thruster_layout import FIXED, ThrusterLayout
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import ERROR, WARN, VesselNode
from vessel_hsmc_ros.nodes.commands import CommandInput, is_nothing
from vessel_hsmc_ros.nodes.reporting import RecentProblem
from vessel_hsmc_ros.plant.dynamics import Wrench

NO_WRENCH = (0.0, 0.0)

RIDE_THROUGH = "vessel_sim.ride_through=true goes on without it"

LISTENING = 0.04
"""Time for which a plant listens once it is connected, s: two of its checks, between which it receives messages."""

SILENCE = 2.0  # time without a command after which the other loop counts as ended, s; the graph shows its plant sooner
Demand = tuple[list[float], list[float]]  # thrusts [N] and angles of all thrusters
NEVER = -(2**63)  # a time before every other, ns


class ThrusterDemands:
    """The demands as they are received, topic by topic: queues of them in lockstep, and the latest ones in real time.

    `topics`: index of the thruster, and 0 for a thrust or 1 for an angle, by topic.
    """

    def __init__(self, layout: ThrusterLayout) -> None:
        self.topics = {topic: (i, part) for topic, i, part in layout.topics()}
        self._queues: dict[str, deque[float]] = {topic: deque() for topic in self.topics}
        each = layout.thrusters()
        self._latest: Demand = [0.0] * len(each), [t.angle if t.kind == FIXED else 0.0 for t in each]
        self._received: dict[str, int] = {}

    def append(self, topic: str, value: float) -> None:
        """Lockstep: queue a demand; the n-th of each topic belongs to the n-th step."""
        self._queues[topic].append(value)

    def complete(self) -> bool:
        """Lockstep: whether the demands of the next step have come on every topic."""
        return all(self._queues.values())

    def take(self, now: int, oldest: int | None = None) -> Demand:
        """Lockstep: the demands of the next step.

        `now`: time of the step, ns. `oldest`: with it, a demand of NaN states that none came, and the last one holds if it is
        not before this time, ns.
        """
        for topic, queue in self._queues.items():
            value = queue.popleft()
            if oldest is None or math.isfinite(value):
                self._set(topic, value)
                self._received[topic] = now
        return self.present(NEVER if oldest is None else oldest)

    def hold(self, topic: str, value: float, now: int) -> str:
        """Real time: hold a demand until the next.

        `value`: N, or rad. `now`: time of receipt, ns. Returns what is wrong with a demand that is ignored; otherwise nothing.
        """
        if not math.isfinite(value):
            return f"{topic} must be a finite number (got {value})"
        self._set(topic, value)
        self._received[topic] = now
        return ""

    def stale(self, oldest: int) -> list[str]:
        """The topics of thrusts without a demand since a time, ns."""
        return [topic for topic, (_, part) in self.topics.items() if part == 0 and self._received.get(topic, NEVER) < oldest]

    def present(self, oldest: int) -> Demand:
        """The demands; thrusts that were received before a time, ns, are zero, while angles hold."""
        thrust, angle = [*self._latest[0]], [*self._latest[1]]
        for topic in self.stale(oldest):
            thrust[self.topics[topic][0]] = 0.0
        return thrust, angle

    def stopped(self) -> Demand:
        """No thrust, at the present angles."""
        return [0.0] * len(self._latest[0]), [*self._latest[1]]

    def forget(self) -> None:
        """Let no demand hold until the next one of its topic."""
        self._received.clear()

    def _set(self, topic: str, value: float) -> None:
        i, part = self.topics[topic]
        self._latest[part][i] = value


class WrenchDrive:
    """Takes `cmd_wrench`.

    `node`: the plant's node; its `stamp` is that of the present step. `answered`: called in lockstep when the command of the
    present step has been received. `topics`: the topics of the commands. `first_command_at`: system time of the first message,
    s; 0 before it. `heard_at`: steady time of the latest message, s; 0 before the first. `answer`: in lockstep, the command of
    the present step once it has been received.
    """

    topics = ("cmd_wrench",)

    def __init__(self, node: VesselNode, answered: Callable[[], None]) -> None:
        p: Any = node.parameters
        self.first_command_at = self.heard_at = 0.0
        self.answer: tuple[float, float] | None = None
        self._node, self._answered, self._parameters = node, answered, p
        self._input = CommandInput(node, "cmd_wrench", p.command_timeout)
        node.listen(WrenchStamped, "cmd_wrench", self._on_command, qos.newest(p.lockstep))

    def present(self) -> tuple[float, float]:
        """The command that holds at present; zero if there is none."""
        return self._input.present() or NO_WRENCH

    def apply(self, plant: Any, command: tuple[float, float]) -> Wrench:
        """The wrench that the plant gives for a command, N, N, N·m."""
        return plant.applied(command)  # type: ignore[no-any-return]

    def reset(self) -> None:
        """Forget all commands, as after a step of the clock."""
        self._input.reset()

    def problem(self) -> tuple[bytes, str] | None:
        """Level and text of what is wrong with the commands at present; None if nothing is."""
        found = self._input.problem()
        return found and (found[0], f"{found[1]}: the wrench is zero" if self._input.present() is None else found[1])

    def values(self) -> dict[str, Any]:
        """Numbers of taken and refused commands, for the diagnostics."""
        return self._input.values()

    def _on_command(self, message: WrenchStamped) -> None:
        self.first_command_at, self.heard_at = self.first_command_at or time.time(), time.monotonic()
        if not self._parameters.lockstep:
            self._input.take(message)
        elif not self._node.finished:
            self._on_answer(message)

    def _on_answer(self, message: WrenchStamped) -> None:
        """Lockstep: take the command of the present step, or the message that there is none."""
        # A command with another stamp belongs to another step and must not advance this one.
        answers = conversions.nanoseconds(message.header.stamp) == self._node.stamp and self.answer is None
        if is_nothing(message):
            if not self._parameters.ride_through:
                raise SimulationError(f"no command came for t = {seconds(self._node.stamp):g} s: {RIDE_THROUGH}")
        elif answers or self._parameters.ride_through:
            self._input.take(message)
        if answers:
            self.answer = self.present()
            self._answered()


class ThrusterDrive:
    """Takes the demands of the thrusters, which have no stamps; attributes and methods are those of `WrenchDrive`."""

    def __init__(self, node: VesselNode, answered: Callable[[], None]) -> None:
        p: Any = node.parameters
        self.first_command_at = self.heard_at = 0.0
        self.answer: Demand | None = None
        self._node, self._answered, self._parameters = node, answered, p
        self._demands = ThrusterDemands(p.vessel.thrusters)
        self._problem = RecentProblem()
        self._refused = 0
        self.topics = tuple(self._demands.topics)
        for topic in self.topics:
            node.listen(Float64, topic, partial(self._on_demand, topic), qos.newest(p.lockstep))

    def present(self) -> Demand:
        """The demands that hold at present; the thrust of each thruster without one is zero, its angle holds."""
        return self._demands.stopped() if self._conflict() else self._demands.present(self._oldest())

    def apply(self, plant: Any, command: Demand) -> Wrench:
        """The wrench that the thrusters give for their demands, N, N, N·m."""
        return plant.applied_thrusts(*command)  # type: ignore[no-any-return]

    def reset(self) -> None:
        """Forget the times of all demands."""
        self._demands.forget()

    def problem(self) -> tuple[bytes, str] | None:
        """Level and text of what is wrong with the demands at present; None if nothing is."""
        if conflict := self._conflict():
            return ERROR, f"{conflict}: the thrust is zero"
        if self._problem.current or self._parameters.lockstep:
            return self._problem.current
        if stale := self._demands.stale(self._oldest()):
            return WARN, f"no recent command on {self._node.resolve_topic_name(stale[0])}: its thrust is zero"
        return None

    def values(self) -> dict[str, Any]:
        """Number of refused demands, for the diagnostics."""
        return {"refused_not_finite": self._refused}

    def _on_demand(self, topic: str, message: Float64) -> None:
        """Take the demand of a thrust or an angle; in lockstep, the messages of all topics make up the command of a step."""
        self.first_command_at, self.heard_at = self.first_command_at or time.time(), time.monotonic()
        if not self._parameters.lockstep:
            if not self._conflict() and (problem := self._demands.hold(topic, message.data, self._now())):
                self._refused += 1
                self._problem.report(WARN, f"{problem}; ignored")
                self._node.get_logger().error(f"{problem}; ignored", throttle_duration_sec=1.0)
        elif not self._node.finished:
            self._demands.append(topic, message.data)
            self.go_on()

    def go_on(self) -> None:
        """Lockstep: answer the step if the demands of every thruster have come."""
        if self.answer is None and self._demands.complete():
            ride_through = self._parameters.ride_through
            self.answer = self._demands.take(self._now(), self._oldest() if ride_through else None)
            self._answered()

    def _conflict(self) -> str:
        return "" if self._parameters.lockstep else self._node.connections.shared(*self.topics)

    def _now(self) -> int:
        """The time of a receipt, ns: demands have no stamp, so that only their receipt counts."""
        if self._parameters.lockstep:
            return self._node.stamp
        simulated = self._node.get_parameter("use_sim_time").value
        return self._node.now() if simulated else time.monotonic_ns()

    def _oldest(self) -> int:
        """The earliest receipt of a demand that still holds, ns."""
        timeout: float = self._parameters.command_timeout
        return self._now() - round(timeout * NANOSECONDS)


class OtherLoop:
    """Shows whether another plant of the same ROS domain is being answered, before the ROS graph shows that plant.

    On a busy machine the graph may show a plant a second late that its topic has a publisher already. In lockstep no command
    comes before a plant's first step; one that comes all the same answers another plant, whose run a first step would disturb.
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


BEFORE_START = -1  # the step that every plant has finished before the first one, as a stamp, ns


class FleetClock:
    """The wait of one plant for the others.

    `followers`: namespaces of the plants that wait for this one's ticks, without slashes; empty for a follower.
    """

    def __init__(self, node: VesselNode, followers: tuple[str, ...]) -> None:
        self._node = node
        self._topics = {f"/{follower}/applied_wrench": BEFORE_START for follower in followers} or {"/clock": BEFORE_START}
        self._follows = not followers
        self._wanted = BEFORE_START
        self._then: Callable[[], None] | None = None
        kind, profile = (Clock, qos.CLOCK) if self._follows else (WrenchStamped, qos.data(lockstep=True))
        for topic in self._topics:
            node.listen(kind, topic, partial(self._on_message, topic), profile)

    def wait(self, finished: int, following: int, then: Callable[[], None]) -> None:
        """Call a function when the next step may begin.

        `finished`: stamp of the step that this plant has finished, ns; BEFORE_START before the first. `following`: stamp of the
        next step, ns. `then`: called at once, or when the last message arrives that it waits for.
        """
        self._wanted, self._then = following if self._follows else finished, then
        self._go_on()

    def wait_for_end(self, finished: int, then: Callable[[], None]) -> None:
        """Call a function when the owner may end: the followers have finished the last step too; a follower ends at once."""
        if self._follows:
            then()
        else:
            self.wait(finished, finished, then)

    @property
    def waiting(self) -> bool:
        """Whether this plant has finished its step and others have not."""
        return self._then is not None

    def lost(self) -> str:
        """The topic that this plant waits for and that no node publishes any more; empty if there is none."""
        behind = (topic for topic, stamp in self._topics.items() if stamp < self._wanted)
        return next((topic for topic in behind if not self._node.count_publishers(topic)), "")

    def _on_message(self, topic: str, message: Clock | WrenchStamped) -> None:
        self._topics[topic] = conversions.nanoseconds(message.clock if self._follows else message.header.stamp)
        self._go_on()

    def _go_on(self) -> None:
        if self._then is not None and min(self._topics.values()) >= self._wanted:
            then, self._then = self._then, None
            then()
