"""Standard manoeuvres: after a straight approach, a programme of surge force and yaw moment that follows no reference.

| symbol | meaning | unit |
|---|---|---|
| psi_0, dpsi | heading at the first step; change of heading since then, not wrapped | rad |
| t | time since the execute, the end of the approach | s |
| X_a, X_max, X_b | surge force of the approach; largest one; the one astern, positive | N |
| N_max, N_d | largest yaw moment; that of the commanded rudder angle | N·m |
| s | side: 1 to port, -1 to starboard | - |
| dpsi_s | change of heading at which the zig-zag reverses the rudder | rad |
| n, T_h | number of steps; duration of each | -, s |
| T | control period | s |

The approach keeps the heading psi_0 by tau_2 = -(N_max/4)·dpsi - sqrt(m33·N_max)·r, critically damped: two time constants of
2·sqrt(m33/N_max), the unit of time of the ship's turns. Speed runs and the bollard pull keep the heading in the same way.

| manoeuvre | surge force | yaw moment, t >= 0 |
|---|---|---|
| turning circle | X_a | s·N_d |
| zig-zag | X_a | s·N_d, reversed whenever the heading has changed by dpsi_s to the side of the moment |
| spiral (Dieudonné) | X_a | from s·N_d in n equal steps to -s·N_d and back |
| crash stop | -X_b until u <= 0, then 0 | 0 |
| speed run | X_max·k/n, k = 1 .. n | heading kept |
| bollard pull | X_max | heading kept |

Open-loop inputs: a surge force and a yaw moment over time, without feedback.

tau_1(t) = F_i, tau_2(t) = N_i from t_i until t_(i+1), and zero before t_0

| symbol | meaning | unit |
|---|---|---|
| t_i | times of the steps, from the first control step on | s |
| F_i, N_i | surge force and yaw moment from t_i on | N, N·m |

It tracks nothing: it sails the manoeuvres from which the hull data of a ship are identified. The ship's limits are not applied
here, the actuators of the ship have them.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import NO_NETWORKS, KernelLaw
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array, clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, wrap
from vessel_hsmc_ros.core.schema import parameter

EARLY = 0.5e-9  # tolerance of half a nanosecond, s: a step takes effect at its instant in spite of rounded times


def inputs(what: str, unit: str) -> tuple[float, ...]:
    """Declare the values of an input, zero by default."""
    return parameter((0.0,), f"{what} from each time on.", unit=unit, low=-1e15, high=1e15)


@dataclass(frozen=True)
class OpenLoopParameters:
    """The inputs over time, in three lists of equal length."""

    times: tuple[float, ...] = parameter(
        (0.0,), "Times of the steps since the first control step, increasing.", unit="s", low=0.0, high=1e6
    )
    surge_force: tuple[float, ...] = inputs("Surge force", "N")
    yaw_moment: tuple[float, ...] = inputs("Yaw moment", "N·m")


class Inputs(NamedTuple):
    """The constants of the law: t_i, F_i and N_i, shape (n,), and the control period, s."""

    times: Array
    surge_force: Array
    yaw_moment: Array
    period: float


class OpenLoopMemory(NamedTuple):
    """Number of control steps, and of steps of the inputs that have begun; W has the shape (0, 0)."""

    updates: int
    begun: int
    W: Array


class OpenLoopTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    heading_error: float


@kernel
def open_loop_step(
    motion: Motion, desired: Motion, _acceleration: Acceleration, m: OpenLoopMemory, c: Inputs
) -> tuple[tuple[float, float], OpenLoopTerms, OpenLoopMemory]:
    """The inputs of the present time.

    `motion`, `desired`, `_acceleration`: ship, reference, and derivatives of its velocities; they change no input.
    """
    begun, time = m.begun, m.updates * c.period + EARLY
    while begun < len(c.times) and c.times[begun] <= time:
        begun += 1
    wrench = (float(c.surge_force[begun - 1]), float(c.yaw_moment[begun - 1])) if begun > 0 else (0.0, 0.0)
    return wrench, OpenLoopTerms(wrap(motion.psi - desired.psi)), OpenLoopMemory(m.updates + 1, begun, m.W)


class OpenLoop(KernelLaw[OpenLoopParameters]):
    """The law; time counts from its first step. `vessel`: not used."""

    name = "open_loop"
    keeps_limits = False
    tracks = False
    kernel = staticmethod(open_loop_step)
    terms = OpenLoopTerms

    def retune(self, parameters: OpenLoopParameters) -> None:
        """Take new inputs."""
        lists = times, surge, yaw = parameters.times, parameters.surge_force, parameters.yaw_moment
        lengths = [len(values) for values in lists]
        if len(set(lengths)) > 1:
            raise ParameterError(
                "controller.open_loop.times, surge_force and yaw_moment are lists of equal length, not of {}, {} and {}".format(
                    *lengths
                )
            )
        for before, after in pairwise(parameters.times):
            if after <= before:
                raise ParameterError(f"controller.open_loop.times must increase: {after:g} s follows {before:g} s")
        self.constants = Inputs(np.array(times), np.array(surge), np.array(yaw), self.period)

    def reset(self) -> None:
        """Begin again."""
        self.memory = OpenLoopMemory(0, 0, NO_NETWORKS)


KINDS = ("turning_circle", "zigzag", "spiral", "crash_stop", "speed_run", "bollard_pull")
"""The manoeuvres, in the order of their numbers in the kernel."""

SIDES = ("port", "starboard")

FULL_RUDDER_DEG = 35.0  # the rudder angle that stands for the whole yaw moment


@dataclass(frozen=True)
class ManoeuvreParameters:
    """Which manoeuvre, and its numbers; docs/manoeuvres.md defines the manoeuvres."""

    kind: str = parameter("turning_circle", "The manoeuvre.", choices=KINDS)
    side: str = parameter("starboard", "Side of the first turn.", choices=SIDES)
    approach_time: float = parameter(
        30.0, "Duration of the approach, a straight run at the initial heading.", unit="s", low=0.0, high=1e6
    )
    approach_share: float = parameter(
        0.85, "Surge force of the approach and of turns, as a share of vessel.surge_force_limit.", low=0.0, high=1.0
    )
    rudder_deg: float = parameter(
        FULL_RUDDER_DEG,
        "Rudder angle of turning circle, zig-zag and spiral. The ship is commanded by a yaw moment: 35° stands for"
        " vessel.yaw_moment_limit, smaller angles for a proportional part of it.",
        unit="°",
        low=0.0,
        high=FULL_RUDDER_DEG,
    )
    switch_heading_deg: float = parameter(
        10.0, "Change of heading at which the zig-zag reverses the rudder.", unit="°", low=0.1, high=90.0
    )
    steps: int = parameter(
        9,
        "Number of yaw moments of a spiral from one side to the other, of which zero is one if it is odd; number of surge forces"
        " of speed runs.",
        low=2,
        high=101,
    )
    hold_time: float = parameter(60.0, "Duration of each step of a spiral and of each speed run.", unit="s", low=0.01, high=1e6)
    astern_share: float = parameter(
        1.0, "Surge force astern of the crash stop, as a share of vessel.surge_force_limit.", low=0.0, high=1.0
    )


TURNING_CIRCLE, ZIGZAG, SPIRAL, CRASH_STOP, SPEED_RUN, BOLLARD_PULL = range(len(KINDS))


class Constants(NamedTuple):
    """The constants by their symbols, and the number of steps of the approach and of T_h."""

    kind: int
    approach: int
    hold: int
    n: int
    s: float
    X_a: float
    X_max: float
    X_b: float
    N_max: float
    N_d: float
    dpsi_s: float
    Kd: float


class Memory(NamedTuple):
    """Internal state."""

    steps: int  # number of steps so far
    psi: float  # heading of the last step, rad
    dpsi: float  # change of heading, rad
    s: float  # side of the present yaw moment of the zig-zag
    stopped: bool  # whether the ship of the crash stop has stopped
    W: NDArray[np.float64]  # there are no networks


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`; the heading error is dpsi, the commanded heading that of the next event."""

    heading_error: float
    commanded_heading: float


@kernel
def step(
    motion: Motion,
    desired: Motion,  # noqa: ARG001 - a manoeuvre follows no reference
    acceleration: Acceleration,  # noqa: ARG001
    m: Memory,
    g: Constants,
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """One period of the approach or of the manoeuvre."""
    dpsi = m.dpsi + wrap(motion.psi - m.psi) if m.steps > 0 else 0.0
    k = m.steps - g.approach
    s = m.s
    if g.kind == ZIGZAG and k > 0 and s * dpsi >= g.dpsi_s:
        s = -s
    stopped = m.stopped or (k > 0 and motion.u <= 0.0)
    force = surge_force(k, stopped, g)
    moment = yaw_moment(k, s, g) if k >= 0 and g.kind < SPEED_RUN else clip(-0.25 * g.N_max * dpsi - g.Kd * motion.r, g.N_max)
    # The heading at which the zig-zag reverses next, or the initial one.
    target = s * g.dpsi_s if g.kind == ZIGZAG and k >= 0 else 0.0
    return (
        (force, moment),
        StepTerms(dpsi, wrap(motion.psi - dpsi + target)),
        Memory(m.steps + 1, motion.psi, dpsi, s, stopped, m.W),
    )


@kernel
def surge_force(k: int, stopped: bool, g: Constants) -> float:
    """The surge force of a step.

    `k`: number of steps since the execute, negative during the approach. `stopped`: whether the ship has stopped since then.
    """
    if g.kind == BOLLARD_PULL:
        return g.X_max
    if g.kind == SPEED_RUN:
        run = k // g.hold + 1 if k > 0 else 1
        return g.X_max * (run if run < g.n else g.n) / g.n
    if g.kind == CRASH_STOP and k >= 0:
        return 0.0 if stopped else -g.X_b
    return g.X_a


@kernel
def yaw_moment(k: int, s: float, g: Constants) -> float:
    """The yaw moment of a turn; the arguments are those of `surge_force`, with the side s of the zig-zag."""
    if g.kind == TURNING_CIRCLE:
        return g.s * g.N_d
    if g.kind == ZIGZAG:
        return s * g.N_d
    if g.kind == SPIRAL:
        # 0 .. n-1 from one side to the other, then back to 0 again, where it stays.
        i = k // g.hold
        i = i if i < g.n else 2 * (g.n - 1) - i
        i = i if i > 0 else 0
        return g.s * g.N_d * (1.0 - 2.0 * i / (g.n - 1))
    return 0.0


class ManoeuvreController(KernelLaw[ManoeuvreParameters]):
    """The programme of a manoeuvre as a law; it does not track the reference.

    `vessel`: the known inertia and the limits, of which the manoeuvre commands shares.
    """

    name = "manoeuvre"
    tracks = False
    kernel = staticmethod(step)
    terms = StepTerms
    memory: Memory

    def retune(self, parameters: ManoeuvreParameters) -> None:
        """Take new numbers and keep the time and the heading of the start."""
        p, known = parameters, self.vessel
        N_max, X_max = known.yaw_moment_limit, known.surge_force_limit
        s = 1.0 if p.side == "port" else -1.0
        self.constants = Constants(
            KINDS.index(p.kind),
            round(p.approach_time / self.period),
            # At least one step each.
            max(1, round(p.hold_time / self.period)),
            p.steps,
            s,
            p.approach_share * X_max,
            X_max,
            p.astern_share * X_max,
            N_max,
            p.rudder_deg / FULL_RUDDER_DEG * N_max,
            math.radians(p.switch_heading_deg),
            math.sqrt(known.yaw_inertia * N_max),
        )

    def reset(self) -> None:
        """Return to the start of the approach."""
        self.memory = Memory(0, 0.0, 0.0, self.constants.s, False, NO_NETWORKS)
