"""Rules for commands: a positive force drives ahead, a positive moment to port, both about as far as the ship's inertia has it.

Each verdict is one of three: right, wrong, or not shown yet. Who obeys a wrong one exchanges wires, so that it takes proof.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.safety.monitors import SLOW_SPEED
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Connection, Finding, Topic
from vessel_hsmc_ros.preflight.effects import GRID, Effect, Motion, driven, effect, least_smoothed, smoothed_command, tracked
from vessel_hsmc_ros.preflight.measured_motion import Samples, motions_of, noises, sample_rate
from vessel_hsmc_ros.preflight.stamp_rules import times_of

WRENCH, VELOCITY = {"force": "surge force", "moment": "yaw moment"}, {"u": "surge speed", "r": "yaw rate"}
"""Columns of the forms of command, and what they are."""

EFFECTS = (
    ("ahead", "astern", "the drives are reversed, or x points astern"),
    ("to port", "to starboard", "steering, port and starboard drives are exchanged, or the state is NED/FRD"),
)

SCALED, CLEAR = 8.0, 0.8
"""How many times the effect of the declared inertia is a mistake, as lag, limits and a current account for less; and the share of
the motion that a command must explain for that."""

INERTIAS = ("surge_inertia", "yaw_inertia")

DELAYS = (0.0, 0.5, 1.0, 2.0)  # times after which velocities follow their commands, s
STEPWISE = 0.9  # share of the time for which a command is constant that a person or a pulse gives, and no law


def judge_signs(connection: Connection, doubted: str = "") -> Iterator[Finding]:
    """Whether force and moment, or speed and yaw rate where these are commanded, have moved the boat in their direction.

    `doubted`: what of the measured motion is wrong, so that it shows no sign; empty if nothing is.
    """
    samples, output = motions_of(connection), connection.of("output")
    by_velocity = output is not None and "u" in output.columns
    command, names = (output, VELOCITY) if by_velocity else (connection.of("command", "applied"), WRENCH)
    if command is None or samples is None or not set(names) <= set(command.columns):
        return
    inertias = (math.nan, math.nan) if by_velocity else connection.inertias
    recorded = record(samples, command, tuple(names), connection)
    found = velocity_effect if by_velocity else wrench_effect
    for k, (what, (right, opposite, cause)) in enumerate(zip(names.values(), EFFECTS, strict=True)):
        about = f"sign of {what.split()[1]}"
        if doubted:
            yield Finding(TODO, about, f"not judged by a motion whose {doubted} is wrong: correct that first")
            continue
        seen = found(recorded, k)
        if seen.sign > 0:
            yield Finding(OK, about, f"positive {what} drives {right}")
            yield from judge_size(what, seen, inertias[k], f"controller.vessel.{INERTIAS[k]}")
        elif seen.sign < 0:
            yield Finding(WRONG, about, f"positive {what} drives {opposite}: {cause}")
        else:
            yield Finding(TODO, about, f"not shown by what the {what} has done so far: {remedy(bool(k), by_velocity)}")


def remedy(turns: bool, by_velocity: bool) -> str:
    """What shows a sign that the motion so far does not show."""
    steps = "turns to both sides at a steady throttle" if turns else "steps of the throttle on a straight course"
    pulse = "0.5,0.2" if by_velocity else "30,20"
    return f"drive {steps}, each some seconds long, and check then or a bag of that; or `vessel-hsmc check --pulse {pulse}`"


def judge_size(what: str, found: Effect, inertia: float, name: str) -> Iterator[Finding]:
    """Whether the effect of a command is about that of the declared inertia; what is not known is nan."""
    times, spread = found.slope * inertia, 3.0 * found.deviation * inertia
    if found.explained > CLEAR and (times - spread > SCALED or times + spread < 1.0 / SCALED):
        cause = f"is it scaled or limited on its way to the drives, or {name} of another ship?"
        yield Finding(WRONG, f"size of {what.split()[1]}", f"the {what} has {times:.2g} times the effect of its number: {cause}")


class Record(NamedTuple):
    """Motion and commands on one grid."""

    poses: Array  # x, y and psi, (n, 3)
    commands: tuple[Array, Array]  # of surge and of yaw, (n,) each
    noises: tuple[float, float]  # standard deviations of a sample of the position, m, and of the heading, rad
    rate: float  # of the samples, Hz
    slow: tuple[float, float]  # speed and yaw rate below which nothing is concluded, m/s and rad/s

    def motion(self, k: int) -> Motion | None:
        """The motion, smoothed until the noise of surge (0) or yaw (1) does not count; None if it always does."""
        return least_smoothed(self.poses, self.noises[k], self.rate, k)


def record(samples: Samples, command: Topic, names: tuple[str, ...], connection: Connection) -> Record:
    """The motion and the commands of some names of a connection."""
    t, motions = samples
    grid = np.arange(t[0], t[-1], GRID)
    columns = *motions[:, :2].T, np.unwrap(motions[:, 2])
    slow = SLOW_SPEED * math.sqrt(GRAVITY * connection.length)
    return Record(
        np.column_stack([np.interp(grid, t, column) for column in columns]),
        (held(command, names[0], grid), held(command, names[1], grid)),
        noises(samples, connection.noise),
        sample_rate(samples),
        (slow, slow / connection.length),
    )


def held(command: Topic, name: str, grid: Array) -> Array:
    """A command at some times: the last value before each, and 0 before the first and from a second after the last."""
    times = times_of(command)
    index = np.searchsorted(times, grid, side="right") - 1
    fresh = (index >= 0) & (grid - times[np.maximum(index, 0)] < 1.0)
    return np.where(fresh, command.columns[name][np.maximum(index, 0)], 0.0)


def velocity_effect(recorded: Record, k: int) -> Effect:
    """Whether surge speed (0) or yaw rate (1) follow their commands, or, of commands in steps, what these do."""
    motion, command = recorded.motion(k), recorded.commands[k]
    if motion is None:
        return Effect(0)
    velocity = motion.r if k else motion.u
    lags = [round(delay / GRID) for delay in DELAYS]
    if len(velocity) < 2 * lags[-1] or math.sqrt(float((velocity**2).mean())) < recorded.slow[k]:
        return Effect(0)
    constant = np.ones(len(velocity))
    around = np.column_stack((np.cos(motion.psi), np.sin(motion.psi)))  # a steady current, along the hull
    load = constant[:, None] if k else around
    found = tracked(smoothed_command(command, motion.width), velocity, load, lags)
    if found or float((np.diff(command) == 0.0).mean()) < STEPWISE:  # else it may follow from the motion
        return Effect(found)
    rest = constant[:, None] if k else np.column_stack((constant, around))
    return Effect(effect([command], motion.dr if k else motion.du, velocity, rest, motion.width).sign)


def wrench_effect(recorded: Record, k: int) -> Effect:
    """The effect of the surge force (0) or of the yaw moment (1)."""
    motion = recorded.motion(k)
    if motion is None:
        return Effect(0)
    u, v, r = motion.u, motion.v, motion.r
    around = np.ones(len(u)), np.cos(motion.psi), np.sin(motion.psi)
    if k:
        return effect(recorded.commands[::-1], motion.dr, r, np.column_stack((*around, u * v, u * r)), motion.width)
    found = effect(recorded.commands[:1], motion.du, u, np.column_stack((*around, v * r, r * r)), motion.width)
    steady = driven(smoothed_command(recorded.commands[0], motion.width), u, motion.psi, recorded.slow[0])
    if not steady:
        return found
    return found._replace(sign=steady if found.sign in (0, steady) else 0)
