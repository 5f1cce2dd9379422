"""What the safety layer makes of a healthy run: every check on every message of an offline run, which must find nothing.

The law of the run is replaced by one that answers with the recorded commands. As long as the supervision passes on every command
bit by bit, that is what the law itself would have commanded under supervision: it has received the same inputs.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.law import Law, Terms
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop
from vessel_hsmc_ros.control.safety.monitors import Alarm
from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.control.safety.samples import Freshness, Jumps, Sample, Verdict
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_motion, extrapolate
from vessel_hsmc_ros.core.metrics import Published
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes.controller_diagnostics import CONDITION_LIMIT, correlation_condition
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.parameters import ControllerParameters
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law
from vessel_hsmc_ros.simulation.offline import ClosedLoop

SURFACES = ("surge_surface", "sway_surface", "heading_surface", "yaw_surface")
NORMS = ("surge_weight_norm", "sway_weight_norm", "yaw_weight_norm")


class Supervised(NamedTuple):
    """What the checks of a run have found.

    Attributes:
        steps: Number of control periods.
        alarms: How often each check was above OK, by its name.
        differing: Control periods whose supervised command is not bit-identical to that of the run.
    """

    steps: int
    alarms: Mapping[str, int]
    differing: int


class _Recorded(Law[Any]):
    """A law that answers with recorded commands, one a step."""

    def __init__(self, law: Law[Any], commands: Array) -> None:
        self.name, self.keeps_limits = law.name, law.keeps_limits  # type: ignore[misc] # those of the law that it stands for
        self.vessel, self._commands = law.vessel, iter(commands)

    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> tuple[tuple[float, float], Terms]:
        """The next command, whatever the inputs."""
        del motion, desired, acceleration
        surge, yaw = next(self._commands)
        return (float(surge), float(yaw)), Terms()


def supervise(scenario: Scenario, progress: Callable[[int, int], None] | None = None) -> Supervised:
    """Run a scenario offline, and its messages through freshness, plausibility, monitors, guard and supervision.

    Args:
        scenario: A scenario without scripted faults.
        progress: As for `simulate`.

    Raises:
        VesselHsmcError: as `simulate`.
    """
    run = ClosedLoop(scenario)
    run.run(progress)
    published, controller = run.published(), scenario.controller
    due = np.searchsorted(published.stamp, published.control_stamp)
    law = _Recorded(make_law(controller), published.command[due])
    loop = make_control_loop(controller, law, supervised=True)
    checks = _Checks(controller, loop)
    differing = sum(checks.step(published, int(k)) for k in due)
    checks.terms(published.control)
    return Supervised(len(due), dict(checks.alarms), differing)


class _Checks:
    """The checks of a controller, and what they have found.

    Args:
        parameters: Those of the controller.
        loop: Its control loop.
    """

    def __init__(self, parameters: ControllerParameters, loop: ControlLoop) -> None:
        p = self._parameters = parameters
        self.alarms: Counter[str] = Counter()
        self._loop, self._jumps = loop, Jumps(p.safety, p.vessel.length)
        self._odometry = Freshness(p.input_timeout, p.safety.freshness, conversions.WORLD, conversions.BODY)
        self._reference = Freshness(p.input_timeout, p.safety.freshness, conversions.WORLD)
        self._reference_at = 0

    def step(self, run: Published, k: int) -> bool:
        """Check the messages of a control period; returns whether the supervised command differs from that of the run.

        Args:
            run: The messages.
            k: Row of the odometry.
        """
        now, measured_at = int(run.stamp[k]), int(run.measured_at[k])
        motion = as_motion(run.odometry[k])
        if measured_at > (-1 if self._odometry.last is None else self._odometry.last):  # late sensors repeat the first sample
            self._take(self._odometry, Sample(measured_at, conversions.WORLD, conversions.BODY, motion), now)
            if self._jumps.check(measured_at, motion) is not Verdict.TAKE:
                self.alarms["jump"] += 1
        i = int(np.searchsorted(run.reference_stamp, now, side="right")) - 1
        desired, rate = as_motion(run.reference[i]), as_acceleration(run.reference_acceleration[i])
        reference_stamp = int(run.reference_stamp[i])
        if self._reference.last != reference_stamp:
            self._take(self._reference, Sample(reference_stamp, conversions.WORLD, "", (*desired, *rate)), now)
        age = seconds(now - measured_at)
        self._loop.step(now, motion, extrapolate(desired, rate, -age), rate, measured_at, age, self._overdue(now))
        self._statuses()
        return bool(np.array(self._loop.wrench).tobytes() != run.command[k].tobytes())

    def terms(self, control: Mapping[str, Array]) -> None:
        """Check the terms of the law against the limits of the diagnostics."""
        limits = self._parameters.diagnostics
        for names, limit in ((SURFACES, limits.surface_limit), (NORMS, limits.weight_norm_limit)):
            for name in names:
                self._add(name, int(np.count_nonzero(np.abs(control[name]) > limit)))

    def _take(self, freshness: Freshness, sample: Sample, now: int) -> None:
        if reason := freshness.accept(sample, now, now):
            self._add(f"refused: {reason.name.lower()}")

    def _overdue(self, now: int) -> Reason:
        return self._odometry.overdue(now, now) or self._reference.overdue(now, now)

    def _statuses(self) -> None:
        loop = self._loop
        if loop.supervision.operation is not Operation.ACTIVE or loop.supervision.reason:
            self._add(f"operation: {loop.supervision.reason.name.lower()}")
        for monitor in loop.watch.monitors if loop.watch else ():
            if monitor.alarm is not Alarm.OK:
                self._add(f"monitor: {monitor.reason.name.lower()}")
        if loop.observer and not correlation_condition(loop.observer.covariance) < CONDITION_LIMIT:
            self._add("numerical health")

    def _add(self, name: str, count: int = 1) -> None:
        if count:
            self.alarms[name] += count
