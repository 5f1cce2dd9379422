"""A control period as one kernel: observer, controlled point and law.

`ControlLoop.step` is the same for any law and under supervision, for the nodes. Compiled loops call the kernel, which `period_of`
makes for one law.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

from vessel_hsmc_ros.control.interface.kernel_law import KernelLaw
from vessel_hsmc_ros.control.interface.law import guarded_step, named
from vessel_hsmc_ros.control.loop.controlled_point import AtControlledPoint, ControlledPoint, Heading, to_controlled_point
from vessel_hsmc_ros.control.loop.observer import ObserverConstants, ObserverState, estimate, observe
from vessel_hsmc_ros.core.exceptions import ControlError, VesselHsmcError
from vessel_hsmc_ros.core.hull import Steering, steered
from vessel_hsmc_ros.core.kernel import DelayLine, bound, delayed, kernel, put
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate

StepOfLaw = tuple[tuple[float, float], Any, Any]  # wrench, terms and memory


class ControlInputs(NamedTuple):
    """What a control period takes."""

    measured_at: int  # time of the measurement, ns
    age: float  # how much older than the period it is, s
    behind: int  # the same in control periods, rounded
    measured: Motion  # state of the ship as measured
    desired: Motion  # state of the reference as published
    acceleration: Acceleration  # derivatives of its body velocities


class ControlState(NamedTuple):
    """What a control period leaves to the next; arrays are written in place."""

    wrench: tuple[float, float]  # commanded surge force [N] and yaw moment [N·m]
    memory: Any  # internal state of the law
    observer: ObserverState  # state of the observer
    delta: Heading  # state of the filter of the headings of `control.loop.controlled_point`
    commands: DelayLine  # the last commands, where there is an observer


class ControlConstants(NamedTuple):
    """Constants of the law, of the observer and of the point that the law controls."""

    law: Any
    observer: ObserverConstants
    point: ControlledPoint
    steering: Steering


class Period(NamedTuple):
    """The result of a control period."""

    state: ControlState  # what it leaves to the next one; without a finite wrench, the present command
    motion: Motion  # the motion that the law has taken
    terms: Any  # terms of the law
    back: tuple[float, float, float, float]  # what the tracking errors of the origin exceed those of the controlled point by
    is_defined: bool  # whether the law has a finite wrench
    is_outdated: bool  # whether the law needs other constants from now on


@kernel
def law_step(at: AtControlledPoint, age: float, heading: float, memory: Any, constants: Any) -> StepOfLaw:  # noqa: ARG001 - a stand-in
    """Stands for the step of a law: `plain`, `with_age` or `with_heading`."""
    return (math.nan, math.nan), (at.motion.x, at.desired.x, age + heading), memory


@kernel
def law_outdated(memory: Any, constants: Any) -> bool:  # noqa: ARG001 - a stand-in
    """Stands for `KernelLaw.outdated` of a law."""
    return False


@kernel
def unobserved(
    stamp: int,  # noqa: ARG001 - instead of `observe`
    pose: Any,  # noqa: ARG001
    wrench: Any,  # noqa: ARG001
    state: ObserverState,
    constants: ObserverConstants,  # noqa: ARG001
) -> ObserverState:
    """Takes the place of `observe` where the observer is switched off, which halves the time of compilation."""
    return state


@kernel
def law_inputs(motion: Motion, given: ControlInputs, delta: Heading, point: ControlledPoint) -> AtControlledPoint:
    """The inputs of the law: the reference at the time of the measurement, both at the controlled point.

    `motion`: state of the ship, measured or estimated. `given`: inputs of the period.
    """
    return to_controlled_point(
        motion, extrapolate(given.desired, given.acceleration, -given.age), given.acceleration, delta, point
    )


@kernel
def control_period(given: ControlInputs, last: ControlState, c: ControlConstants) -> Period:
    """Estimate the motion, and step the law at its point.

    `given`: inputs of the period. `last`: what the last period has left; its arrays are written.
    """
    wrench, memory, observed, delta, commands = last
    motion = given.measured
    if c.observer.enabled:
        pose = (motion.x, motion.y, motion.psi)
        then = delayed(commands, given.behind, 0), delayed(commands, given.behind, 1)
        observed = observe(given.measured_at, pose, then, observed, c.observer)
        motion = estimate(observed)
    at = law_inputs(motion, given, delta, c.point)
    demand, terms, memory = law_step(at, given.age, given.measured.psi, memory, c.law)
    if not (math.isfinite(demand[0]) and math.isfinite(demand[1])):
        return Period(ControlState(wrench, memory, observed, delta, commands), motion, terms, at.back, False, False)
    demand = steered(demand, motion.u, c.steering)
    if c.observer.enabled:
        put(commands, demand)
    is_outdated = law_outdated(memory, c.law)
    return Period(ControlState(demand, memory, observed, at.delta, commands), motion, terms, at.back, True, is_outdated)


@kernel
def step(*_inputs: Any) -> StepOfLaw:
    """Stands for the kernel of a law."""
    return (math.nan, math.nan), (), ()


@kernel
def plain(at: AtControlledPoint, age: float, heading: float, memory: Any, constants: Any) -> StepOfLaw:  # noqa: ARG001 - as `law_step`
    """The step of a law that takes no age."""
    return step(at.motion, at.desired, at.acceleration, memory, constants)


@kernel
def with_age(at: AtControlledPoint, age: float, heading: float, memory: Any, constants: Any) -> StepOfLaw:  # noqa: ARG001 - as `law_step`
    """The step of a law that takes the age, s."""
    return step(at.motion, at.desired, at.acceleration, memory, constants, age)


@kernel
def with_heading(at: AtControlledPoint, age: float, heading: float, memory: Any, constants: Any) -> StepOfLaw:
    """The step of a law that takes the age, s, and the measured heading."""
    return step(at.motion, at.desired, at.acceleration, memory, constants, age, heading)


@functools.cache
def period_of(law: type[KernelLaw[Any]], observed: bool) -> Callable[..., Period]:
    """`control_period` with a law, with the observer or without: the kernel that a compiled loop calls by that name."""
    step_of_law = bound(with_heading if law.takes_heading else with_age if law.takes_age else plain, step=law.kernel)
    kernels: dict[str, Callable[..., Any]] = {"law_step": kernel(step_of_law), "law_outdated": law.outdated}
    made = bound(control_period, **kernels | ({} if observed else {"observe": unobserved}))
    # By which its machine code is kept.
    made.__module__, made.__qualname__ = law.kernel.__module__, law.kernel.__qualname__ + "_observed" * observed
    return kernel(made)


def cause(law: KernelLaw[Any], given: ControlInputs, last: ControlState, c: ControlConstants) -> VesselHsmcError:
    """The error of a law in a period in which its kernel has no finite wrench: the interpreted law finds its cause.

    `law`: the law, with the memory that the periods before have left. `given`: inputs of the period. `last`: what the period
    has left.
    """
    motion = estimate(last.observer) if c.observer.enabled else given.measured
    at = law_inputs(motion, given, last.delta, c.point)
    try:
        guarded_step(law, at.motion, at.desired, at.acceleration, given.age, given.measured.psi)
    except VesselHsmcError as error:
        return error
    return ControlError(f"law {named(law)} commanded a wrench that is not finite")
