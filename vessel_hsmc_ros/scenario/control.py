"""The control loop that the parameters of a controller describe; node, simulations and verification of bags run it."""

import dataclasses
import math
from typing import Any

from vessel_hsmc_ros.control.interface.actuators import dynamics, unit_time
from vessel_hsmc_ros.control.interface.law import Law
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop, Fallback, Watch
from vessel_hsmc_ros.control.loop.control_period import ControlledPoint, controlled_point_of
from vessel_hsmc_ros.control.safety.fence_guard import Braking, FenceGuard
from vessel_hsmc_ros.control.safety.supervision import Authority, Supervision
from vessel_hsmc_ros.core.fence import fence_of
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.scenario.parameters import ControllerParameters
from vessel_hsmc_ros.scenario.scenario import make_law, make_observer


def make_controlled_point(parameters: ControllerParameters) -> ControlledPoint:
    """Make the point that a controller controls. Raises ParameterError as `KnownVessel.percussion_point`."""
    return controlled_point_of(parameters.vessel, 1.0 / parameters.rate_hz)


def fenced(parameters: ControllerParameters) -> bool:
    """Whether the vessel has a fence. Raises ParameterError as `fence_of`."""
    return fence_of(parameters.safety.fence, "controller.safety.fence") is not None


def may_intervene(parameters: ControllerParameters) -> bool:
    """Whether the supervision may change what the law of a lockstep run commands.

    By default it does not: there a fault ends the run with an error, and what a law computes is the subject of study.
    """
    safety = parameters.safety
    rates, limits = (safety.surge_force_rate, safety.yaw_moment_rate), (safety.surge_force_limit, safety.yaw_moment_limit)
    return (
        fenced(parameters) or parameters.ride_through or any(map(math.isfinite, rates)) or any(limit >= 0.0 for limit in limits)
    )


def make_control_loop(
    parameters: ControllerParameters, law: Law[Any] | None = None, supervised: bool | None = None
) -> ControlLoop:
    """Make the control loop of a controller.

    `supervised`: whether guard and monitors act; by default in real time, and in lockstep where the parameters choose it.
    """
    if supervised is None:
        supervised = not parameters.lockstep or may_intervene(parameters)
    law, vessel, safety = law or make_law(parameters), parameters.vessel, parameters.safety
    limits = vessel.surge_force_limit, vessel.yaw_moment_limit
    inertia = vessel.surge_inertia, vessel.yaw_inertia
    bounded = law.keeps_limits
    authority = Authority(limits, inertia, supervised and bounded, supervised and not bounded)
    supervision = Supervision(safety, authority)
    return ControlLoop(
        law,
        RateGrid(parameters.rate_hz),
        make_observer(parameters),
        make_controlled_point(parameters),
        supervision,
        _make_fallback(parameters) if supervised else None,
        Watch(safety.monitors, limits, vessel.length, _make_fence_guard(parameters, authority)) if supervised else None,
    )


TURN_INTO_CURRENT = 10.0  # time in which a vessel turns into the current, in terms of the time of its turns


def _make_fence_guard(parameters: ControllerParameters, authority: Authority) -> FenceGuard | None:
    """What keeps the vessel inside of its fence. Raises ParameterError as `fence_of`."""
    fence = fence_of(parameters.safety.fence, "controller.safety.fence")
    if fence is None:
        return None
    return FenceGuard(parameters.safety.fence, fence, braking_of(parameters), authority, parameters.vessel.length)


def braking_of(parameters: ControllerParameters) -> Braking:
    """What a vessel can do against its motion, by what is declared of it."""
    vessel, inputs, period = parameters.vessel, dynamics(parameters.vessel), 1.0 / parameters.rate_hz
    late = inputs.yaw.dead_time + inputs.yaw.lag + period
    turn, heading = TURN_INTO_CURRENT * unit_time(vessel) + late, unit_time(vessel) + 2.0 * late
    m, surge = vessel.surge_inertia, inputs.surge
    return Braking(vessel.surge_force_limit / m, surge.lag, surge.dead_time, surge.rate / m, turn, heading, period)


def _make_fallback(parameters: ControllerParameters) -> Fallback | None:
    """The law of the safe action, with its own parameters."""
    name = parameters.safety.fallback_law
    if parameters.safety.action != "fallback":
        return None
    safety = dataclasses.replace(parameters.safety, action="ramp")  # the fallback has none of its own
    return Fallback(make_law(dataclasses.replace(parameters, law=name, safety=safety)))
