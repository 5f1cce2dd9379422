"""The plant driven by thrusters instead of a wrench, and their dynamics.

Each thrust follows its demand within limits, rate and lag; together they make the wrench on the hull,

    X = sum T·cos(alpha)      Y = sum T·sin(alpha)      N = sum x·T·sin(alpha) - y·T·cos(alpha)

for fixed thrusters and azimuths of direction alpha. A rudder has instead the force T ahead and the lift
L = (l·d - l_2·|d|d)·(|u|u + s·max(T, 0)) to port, with the rudder angle d and the surge speed u through the water; beyond its
limits no angle is taken. The equations are those of `core.thruster_layout`, which names their source.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.kernel import between, clip, kernel
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, FIXED, RUDDER, ThrusterLayout
from vessel_hsmc_ros.plant.devices import follow
from vessel_hsmc_ros.plant.dynamics import Wrench
from vessel_hsmc_ros.plant.simulator import PlantConstants, PlantParameters, PlantState, Simulator


class Thrusters(NamedTuple):
    """The constants of all thrusters in discrete time, an element for each."""

    kind: Any  # index in KINDS
    # x, y: position, m
    x: Any
    y: Any
    # ahead, astern: largest thrusts, N
    ahead: Any
    astern: Any
    thrust_change: Any  # largest change of the thrust in a period, N
    share: Any  # 1 - exp(-T/T_l), the share of a step that the lag completes in a period; 1 without lag
    # angle_limit, angle_change: largest angle, and its largest change in a period
    angle_limit: Any
    angle_change: Any
    # lift, lift_quadratic, slipstream: l, l_2 and s of a rudder
    lift: Any
    lift_quadratic: Any
    slipstream: Any


class ThrusterState(NamedTuple):
    """Thrusts [N] and angles of all thrusters, arrays that are written in place."""

    thrust: Any
    angle: Any


def thrusters_of(layout: ThrusterLayout, period: float, sequence: Callable[[list[float]], Any] = tuple) -> Thrusters:
    """The constants of the thrusters. `sequence`: what to keep their values in: tuples, or arrays for compiled kernels."""
    each = layout.thrusters()
    rows: list[list[float]] = [
        [t.kind for t in each],
        [t.x for t in each],
        [t.y for t in each],
        [t.thrust_ahead for t in each],
        [t.thrust_astern for t in each],
        [t.thrust_rate * period for t in each],
        [-math.expm1(-period / t.lag) if t.lag else 1.0 for t in each],
        [t.angle_limit for t in each],
        [t.angle_rate * period for t in each],
        [t.lift for t in each],
        [t.lift_quadratic for t in each],
        [t.slipstream for t in each],
    ]
    return Thrusters(*(sequence([float(value) for value in row]) for row in rows))


def idle(layout: ThrusterLayout) -> ThrusterState:
    """The state without thrust; the angle of a fixed thruster is its direction, of others straight ahead."""
    each = layout.thrusters()
    return ThrusterState(np.zeros(len(each)), np.array([t.angle if t.kind == FIXED else 0.0 for t in each]))


@kernel
def respond(state: ThrusterState, thrust: Any, angle: Any, c: Thrusters) -> None:
    """Advance thrusts and angles by a period in which the demands are constant.

    `state`: to be written; the angles of fixed thrusters stay. `thrust`, `angle`: demands, (k,), N and rad, finite.
    """
    for i in range(len(c.x)):
        target = between(thrust[i], -c.astern[i], c.ahead[i])
        state.thrust[i] = follow(state.thrust[i], target, c.thrust_change[i], c.share[i], c.share[i] == 1.0)
        if c.kind[i] == FIXED:
            continue
        last = state.angle[i]
        if c.angle_limit[i] >= ALL_ROUND:  # the shorter way round
            state.angle[i] = wrap(last + clip(wrap(angle[i] - last), c.angle_change[i]))
        else:
            state.angle[i] = last + clip(clip(angle[i], c.angle_limit[i]) - last, c.angle_change[i])


@kernel
def hull_wrench(state: ThrusterState, u: float, c: Thrusters) -> tuple[float, float, float]:
    """The wrench of all thrusters on the hull: surge force [N], sway force [N], yaw moment [N·m].

    `u`: surge speed through the water, m/s.
    """
    x = y = n = 0.0
    for i in range(len(c.x)):
        thrust, angle = float(state.thrust[i]), float(state.angle[i])
        if c.kind[i] == RUDDER:
            flow = abs(u) * u + (c.slipstream[i] * thrust if thrust > 0.0 else 0.0)
            ahead, port = thrust, (c.lift[i] - c.lift_quadratic[i] * abs(angle)) * angle * flow
        else:
            ahead, port = thrust * math.cos(angle), thrust * math.sin(angle)
        x, y, n = x + ahead, y + port, n + (c.x[i] * port - c.y[i] * ahead)
    return x, y, n


class ThrusterPlant(Simulator):
    """A plant with thrusters.

    `parameters`: parameters of the plant, with a layout of thrusters. `period`: time between two odometry messages, s.
    """

    def __init__(self, parameters: PlantParameters, period: float) -> None:
        self._layout = parameters.vessel.thrusters
        self._thrusters = thrusters_of(self._layout, period)
        super().__init__(parameters, period)

    def reset(self) -> None:
        """Return to the initial state, without thrust."""
        super().reset()
        self._thrust = idle(self._layout)

    def applied_thrusts(self, thrust: Sequence[float], angle: Sequence[float]) -> Wrench:
        """The wrench that the thrusters give, N, N, N·m; call it once per step, because it advances the thrusters.

        `thrust`, `angle`: demands in the order of the layout, N and rad; the angle of a fixed thruster is ignored.
        """
        for thruster, *demands in zip(self._layout.thrusters(), thrust, angle, strict=True):
            if not all(map(math.isfinite, demands)):  # a NaN would remain in the state indefinitely
                texts = " N and ".join(map(str, demands))
                raise SimulationError(f"demand of thruster {thruster.name} must be finite numbers (got {texts} rad)")
        self._state = apply_thrusts(self._state, thrust, angle, self._constants, self._thrust, self._thrusters)
        return self._state.tau


def make_plant(parameters: PlantParameters, period: float) -> Any:
    """The plant that parameters describe: driven by thrusters or by a wrench. `period`: time between two odometry messages, s."""
    return (ThrusterPlant if parameters.by_thrusters else Simulator)(parameters, period)


@kernel
def apply_thrusts(
    state: PlantState, thrust: Sequence[float], angle: Sequence[float], c: PlantConstants, now: ThrusterState, t: Thrusters
) -> PlantState:
    """The state with the wrench tau that the thrusters give in this period.

    `thrust`, `angle`: demands, N and rad, finite. `now`, `t`: state of the thrusters, which is written, and their constants.
    """
    respond(now, thrust, angle, t)
    psi = state.motion.psi
    through_water = state.motion.u - (c.current[0] * math.cos(psi) + c.current[1] * math.sin(psi))
    return PlantState(state.motion, state.measured, hull_wrench(now, through_water, t), state.gust, state.commands, state.sent)
