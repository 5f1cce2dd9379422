"""Rules for commands: a positive force drives ahead, a positive moment to port, both about as far as the ship's inertia has it.

And stop and time-out have been tried.
"""

import math
from collections.abc import Iterator

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.safety.connection import OK, TODO, WRONG, Connection, Finding, Topic
from vessel_hsmc_ros.safety.motion_rules import means, motions_of
from vessel_hsmc_ros.safety.stamp_rules import times_of

STEP = 0.5
"""Interval of the samples of command and motion, s."""

SURE = 4.0
"""Deviations from which on the sign of an effect is certain."""

WRENCH, VELOCITY = {"force": "surge force", "moment": "yaw moment"}, {"u": "surge speed", "r": "yaw rate"}
"""Columns of the forms of command, and what they are."""

EFFECTS = (
    ("ahead", "astern", "the drives are reversed, or x points astern"),
    ("to port", "to starboard", "steering, port and starboard drives are exchanged, or the state is NED/FRD"),
)

OUTPUTS = ("force", "moment", "u", "r", "value")
"""The columns of commands."""

TIMEOUTS = ("OVERDUE", "STAMP_OLD")

SCALED = 5.0
"""How many times the effect of the declared inertia is a mistake; lag, limits and a current account for less."""

INERTIAS = ("surge_inertia", "yaw_inertia")


def judge_signs(connection: Connection) -> Iterator[Finding]:
    """Whether force and moment, or speed and yaw rate where these are commanded, have moved the boat in their direction."""
    samples, output = motions_of(connection), connection.of("output")
    by_velocity = output is not None and "u" in output.columns
    command, names = (output, VELOCITY) if by_velocity else (connection.of("command", "applied"), WRENCH)
    if command is None or samples is None or not set(names) <= set(command.columns):
        return
    t, motions = samples
    commands = [held(command, name, t) for name in names]
    columns = np.column_stack((t, motions[:, :2], np.unwrap(motions[:, 2]), *commands))
    middle_times, x, y, psi, *wrench = means(t, columns, STEP).T
    middle, steps = 0.5 * (psi[1:] + psi[:-1]), np.diff(middle_times)
    rates = (np.cos(middle) * np.diff(x) + np.sin(middle) * np.diff(y)) / steps, np.diff(psi) / steps
    inertias = (math.nan, math.nan) if by_velocity else connection.inertias
    for k, (what, (right, opposite, cause)) in enumerate(zip(names.values(), EFFECTS, strict=True)):
        about = f"sign of {what.split()[1]}"
        sign, slope = effect(wrench[k], rates[k])
        if sign > 0:
            yield Finding(OK, about, f"positive {what} drives {right}")
            yield from judge_size(what, slope / STEP * inertias[k], f"controller.vessel.{INERTIAS[k]}")
        elif sign < 0:
            yield Finding(WRONG, about, f"positive {what} drives {opposite}: {cause}")
        else:
            pulse = "" if by_velocity else ", or `vessel-hsmc check --pulse FORCE,MOMENT`"
            text = f"no {what} has moved the boat yet: check while it sails turns, or a bag of that{pulse}"
            yield Finding(TODO, about, text)


def judge_size(what: str, times: float, inertia: str) -> Iterator[Finding]:
    """Whether the effect of a command is about that of the declared inertia; what is not known is nan."""
    if times > SCALED or times < 1.0 / SCALED:
        cause = f"is it scaled or limited on its way to the drives, or {inertia} of another ship?"
        yield Finding(WRONG, f"size of {what.split()[1]}", f"the {what} has {times:.2g} times the effect of its number: {cause}")


def held(command: Topic, name: str, grid: Array) -> Array:
    """A command at some times: the last value before each, and 0 before the first and from a second after the last."""
    times = times_of(command)
    index = np.searchsorted(times, grid, side="right") - 1
    fresh = (index >= 0) & (grid - times[np.maximum(index, 0)] < 1.0)
    return np.where(fresh, command.columns[name][np.maximum(index, 0)], 0.0)


def effect(command: Array, rate: Array) -> tuple[int, float]:
    """The sign of the effect of a command on the change of a velocity, 0 if it is not certain, and the effect a.

    A least-squares fit of rate[k+1] - rate[k] = a·command - b·rate[k] + c, for commands that are 0 to 2 samples old.
    """
    verdicts = []
    for delay in range(3):
        n = len(rate) - 1 - delay
        if n < 12:
            continue
        tau, before = command[: len(rate) - 1][:n], rate[delay : delay + n]
        if np.std(tau) < 1e-9 + 0.01 * float(np.abs(tau).max()):
            continue
        a = np.column_stack((tau, before, np.ones(n)))
        change = rate[delay + 1 : delay + 1 + n] - before
        found, *_ = np.linalg.lstsq(a, change, rcond=None)
        rest = change - a @ found
        covariance = np.linalg.pinv(a.T @ a) * float(rest @ rest) / max(n - 3, 1)
        verdicts.append((float(found[0]) / math.sqrt(max(covariance[0, 0], 1e-300)), float(found[0])))
    best, slope = max(verdicts, key=lambda verdict: abs(verdict[0]), default=(0.0, 0.0))
    return (int(np.sign(best)) if abs(best) > SURE else 0), slope


def judge_exercises(connection: Connection) -> Iterator[Finding]:
    """Whether stop and time-out have been tried."""
    if not any(role.name == "command" for role in connection.roles):
        return
    if "stop" in connection.events:
        yield Finding(OK, "stop", "tried: a stop was called")
    else:
        yield Finding(TODO, "stop", "not tried: `vessel-hsmc call stop` while the boat moves, then `vessel-hsmc call rearm`")
    if silenced(connection):
        yield Finding(OK, "time-out", "tried: without commands the output of the drive went to zero")
    elif tried := [reason for reason in connection.reasons if reason in TIMEOUTS]:
        yield Finding(OK, "time-out", f"tried: the safe action began with {', '.join(tried)}")
    else:
        yield Finding(
            TODO, "time-out", "not tried: end the publisher of the state while the boat moves slowly; its thrust must end"
        )


def silenced(connection: Connection) -> bool:
    """Whether an output that was not zero went to zero although the last command was not."""
    command = next((connection.topic(role) for role in connection.roles if role.name == "command"), None)
    outputs = [connection.topic(role) for role in connection.roles if role.name in ("output", "throttle", "steering")]
    if command is None or not len(command.received) or "force" not in command.columns:
        return False
    if not (command.columns["force"][-1] or command.columns["moment"][-1]):
        return False
    values = [[output.columns[name] for name in OUTPUTS if name in output.columns] for output in outputs]
    last = [column[-1] for columns in values for column in columns if len(column)]
    return bool(last) and not any(last) and any(column.any() for columns in values for column in columns)
