"""The cells of the fault matrix, and the judgement of what a run commanded in each."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.bags import run_from_bag
from vessel_hsmc_ros.bags.reader import Bag
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT
from vessel_hsmc_ros.control.laws import LAWS as LAWS_OF_PACKAGE
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.faults import Fault
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.offline import simulate

Array = NDArray[np.float64]

LAWS = ("hierarchical", "guided", "los_pid")
MODES = ("lockstep", "real time")
TOPICS = {"odometry": "odom", "reference": "reference", "command": "cmd_wrench", "processes": ""}
RATE = 20.0
LEAD = {"lockstep": 120.0, "real time": 8.0}
"""Time before the first fault, s: in lockstep the ship has reached its reference by then."""

LASTS = {"lockstep": 4.0, "real time": 3.0}
"""Length of a fault, s, where the matrix gives none; above the time-outs."""

SPACING = {"lockstep": 64.0, "real time": 9.0}
"""Time from one fault to the next, s: in lockstep the 60 s to recover and the fault; in real time to be active again."""

RECOVERY = 60.0
"""Longest time in which the ship has to be back at its undisturbed error, s."""

MARGIN = 0.5
"""Position error above that of the undisturbed ship that counts as recovered, m: a tenth of a ship's width."""

SCENARIO = {
    "vessel_sim.rate_hz": RATE,
    "reference_ship.rate_hz": RATE,
    "controller.rate_hz": RATE,
    # The actuators of this ship are instant, and declared so: the guided law then returns fast.
    **{f"controller.vessel.{name}": value for name, value in INSTANT.items()},
    "controller.input_timeout": 0.5,
    "controller.ride_through": True,  # of the undisturbed run too, whose commands are then within the same limits
    "vessel_sim.command_timeout": 2.0,
}

ACTIVE, SAFE, HANDOVER = 1, 2, 24


@dataclass(frozen=True)
class Cell:
    """One fault of the matrix, with one law in one mode, and its result."""

    target: str
    name: str
    law: str
    mode: str
    expect: str
    reason: str
    same: bool
    fault: Fault
    problems: tuple[str, ...] = ()
    recovery: float | None = None


class Recording:
    """What a run commanded, in seconds since the first odometry."""

    def __init__(self, bag: Bag, scenario: Scenario) -> None:
        topics = bag.topics
        bag.load("cmd_wrench", "applied_wrench", "controller/state", "odom", "reference")
        self.run: Run = bag.run(weights=False)
        start = int(topics["/odom"].stamp.min())
        odometry, commands, states = topics["/odom"], topics["/cmd_wrench"], topics["/controller/state"]
        applied = topics["/applied_wrench"]
        self.end = float(run_from_bag.seconds_of(odometry.stamp.max() - start))
        # In real time by receipt: the controller's own clock may be off.
        real_time = not scenario.controller.lockstep
        self.command_at, self.command = _in_order(commands, run_from_bag.wrenches(commands)[:, [0, 2]], start, real_time)
        self.applied_at, self.applied = _in_order(applied, run_from_bag.wrenches(applied)[:, [0, 2]], start)
        self.state_at, columns = _in_order(states, np.column_stack([states["operation"], states["reason"]]), start, real_time)
        self.operation, self.reason = columns.T
        vessel = scenario.controller.vessel
        self.limits = np.array([vessel.surge_force_limit, vessel.yaw_moment_limit])
        self.bounded = LAWS_OF_PACKAGE[scenario.controller.law].controller.keeps_limits
        self.rates = self.limits / scenario.controller.safety.ramp_time
        self.input_timeout = scenario.controller.input_timeout
        self.command_timeout = scenario.vessel_sim.command_timeout
        self.error = np.hypot(*(self.run.state[:, :2] - self.run.reference[:, :2]).T)
        self.undisturbed = undisturbed(scenario) if scenario.controller.lockstep else None


def _in_order(series: Any, values: Array, start: int, by_receipt: bool = False) -> tuple[Array, Array]:
    times = series.log_time if by_receipt else series.stamp
    order = np.argsort(times, kind="stable")
    return run_from_bag.seconds_of(times[order] - start), values[order]


_UNDISTURBED: dict[tuple[str, float], Run] = {}


def undisturbed(scenario: Scenario) -> Run:
    """The run without faults."""
    key = scenario.controller.law, scenario.vessel_sim.duration
    if key not in _UNDISTURBED:
        _UNDISTURBED[key] = simulate(scenario)
    return _UNDISTURBED[key]


def judge(cell: Cell, recording: Recording, failure: str) -> Cell:
    """Compare what was commanded with what is expected."""
    begin, end = cell.fault.at, cell.fault.at + cell.fault.duration
    until = begin + SPACING[cell.mode] - 1.0 / RATE
    if recording.end < min(until, end + 1.0):
        return replace(cell, problems=(f"the run ended at {recording.end:.1f} s: {failure}",))
    problems = [*commanded_wrong(recording, begin, until), *reacted_wrong(cell, recording, begin, end)]
    recovery = recovered_after(recording, end, until)
    limit = RECOVERY if cell.mode == "lockstep" else SPACING[cell.mode] - cell.fault.duration - 0.5
    if recovery is None or recovery > limit:
        problems.append(f"not recovered within {limit:g} s")
    return replace(cell, problems=tuple(problems), recovery=recovery)


def commanded_wrong(recording: Recording, begin: float, until: float) -> Iterator[str]:
    """Commands that are not finite, over their limit, or over the rate of transitions."""
    at = (recording.command_at >= begin) & (recording.command_at < until)
    commands, times = recording.command[at], recording.command_at[at]
    if not np.isfinite(commands).all():
        yield "a command is not finite"
    elif recording.bounded and (np.abs(commands) > recording.limits * (1.0 + 1e-12)).any():
        yield "a command is over its limit"
    applied = recording.applied[(recording.applied_at >= begin) & (recording.applied_at < until)]
    if not np.isfinite(applied).all():
        yield "an applied wrench is not finite"
    index = np.searchsorted(recording.state_at, times)
    index = np.minimum(index, len(recording.state_at) - 1)
    bound = ((recording.operation == SAFE) | (recording.reason == HANDOVER))[index][1:]
    # A law without limits may be above those of the ship: the transition starts from what the actuators gave.
    steps = np.abs(np.diff(np.clip(commands, -recording.limits, recording.limits), axis=0))[bound]
    intervals = np.maximum(np.diff(times)[bound], 1.0 / RATE)
    if len(steps) and (steps > (recording.rates * intervals[:, None]) * (1.0 + 1e-6) + 1e-6).any():
        worst = float(np.max(steps / (recording.rates * intervals[:, None])))
        yield f"a transition is {worst:.2g} times faster than its rate"


def reacted_wrong(cell: Cell, recording: Recording, begin: float, end: float) -> Iterator[str]:
    """What the controller or the plant should have done during the fault and did not."""
    periods = 2.0 / RATE + (0.05 if cell.mode == "real time" else 0.0)  # the script's own timer, and the processes
    during = (recording.state_at >= begin) & (recording.state_at < end)
    left = recording.state_at[during & (recording.operation != ACTIVE)]
    if cell.expect == "safe":
        if not len(left):
            yield "the law commands throughout"
        elif left[0] - begin > recording.input_timeout + periods:
            yield f"safe after {left[0] - begin:.2f} s only"
    if cell.expect == "active" and len(left):
        reason = int(recording.reason[during & (recording.operation != ACTIVE)][0])
        yield f"the law does not command, reason {reason}"
    if cell.expect == "idle":
        at = recording.applied_at
        late = (at > begin + recording.command_timeout + periods) & (at < end)
        if not late.any() or recording.applied[late][0].any():
            yield "a wrench is applied after the time-out"
    if cell.same and recording.undisturbed is not None:
        rows = (recording.run.time >= begin) & (recording.run.time < end)
        if not np.array_equal(recording.run.wrench[rows], _at(recording.undisturbed, recording.run.time[rows])):
            yield "not as without the fault"


def _at(run_: Run, times: Array) -> Array:
    return np.asarray(run_.wrench[np.searchsorted(run_.time, times - 1e-9)])


def recovered_after(recording: Recording, end: float, until: float) -> float | None:
    """Time after the fault from which on the ship stays at its undisturbed error; in real time, until the law commands again."""
    if recording.undisturbed is None:
        rows = (recording.state_at >= end) & (recording.state_at < until)
        good = recording.operation[rows] == ACTIVE
        times = recording.state_at[rows]
    else:
        rows = (recording.run.time >= end) & (recording.run.time < until)
        times = recording.run.time[rows]
        run_ = recording.undisturbed
        index = np.minimum(np.searchsorted(run_.time, times), len(run_.time) - 1)
        error = np.hypot(*(run_.state[index, :2] - run_.reference[index, :2]).T)
        good = recording.error[rows] <= error + MARGIN
    if not len(good) or not good[-1]:
        return None
    bad = np.flatnonzero(~good)
    return float(times[bad[-1] + 1] - end) if len(bad) else 0.0
