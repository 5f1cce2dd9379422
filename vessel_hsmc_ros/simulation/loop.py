"""What the two ways to run a closed loop have in common: rows of a run, the terms of the law, and which laws are compiled.

One way is here: the loop of the classes that the nodes use, stepped in one process, in which any law runs; and the controller
over recorded inputs.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import FLAGS, KernelLaw, Law, Terms, lyapunov_function, lyapunov_rates, weight_norms
from vessel_hsmc_ros.control.loop.allocation import Allocation
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_motion, as_published, extrapolate
from vessel_hsmc_ros.core.timing import RateGrid, seconds
from vessel_hsmc_ros.guidance.factory import Reference, make_reference
from vessel_hsmc_ros.guidance.following import FollowingReference
from vessel_hsmc_ros.plant.dynamics import Wrench, acceleration
from vessel_hsmc_ros.plant.thruster_plant import make_plant
from vessel_hsmc_ros.scenario.control import make_control_loop, may_intervene
from vessel_hsmc_ros.scenario.scenario import Scenario


def is_compilable(law: type[Any]) -> bool:
    """Whether a law is one of the package; the kernels of a user's may not be what they seem."""
    return law.__module__.startswith("vessel_hsmc_ros.")


def all_terms(law: KernelLaw[Any], stamps: NDArray[np.int64], grid: RateGrid, terms: Array, weights: Array) -> dict[str, Array]:
    """The terms of every control period, with what follows from them as in `terms.diagnosed`.

    `stamps`: times of the control periods, (m,) ns. `terms`: terms of the kernel, (m, t). `weights`: weights of its networks,
    (m, k, l). Returns all fields of `Terms`, m rows each.
    """
    m = len(stamps)
    given = dict(zip(law.terms._fields, terms.T, strict=True))
    given |= {f"{name}_weights": weights[:, i] for i, name in enumerate(law.networks)}
    found: dict[str, Any] = {}
    for name, default in Terms._field_defaults.items():
        values = given.get(name, np.empty((m, 0)) if name.endswith("_weights") else np.full(m, default))
        found[name] = values != 0.0 if name in FLAGS else np.ascontiguousarray(values)
    for i, norm in enumerate(weight_norms(weights).T):
        found[f"{law.networks[i]}_weight_norm"] = norm
    found["lyapunov"] = lyapunov_function(found["yaw_surface"], found["surge_surface"])
    intervals = np.diff(grid.indices(stamps), prepend=0) * grid.period
    found["lyapunov_rate"] = lyapunov_rates(found["lyapunov"], intervals)
    return found


Stamps = NDArray[np.int64]

WIDTHS = {
    **{"time": 1, "state": 6, "measured": 6, "reference": 6, "wrench": 2, "command": 2},
    **{"disturbance": 3, "unforced_acceleration": 3, "headings": 2, "disturbing_wrench": 3, "sway_force": 1},
}
"""Columns of a row, with states as their messages give them; `wrench` is the applied one, without its `sway_force`, `headings`
are those of the state and of the measurement in the messages, not wrapped."""

WIDTH = sum(WIDTHS.values())

BRIEF = 7  # numbers of a step that metrics need; see `preparation.Kept`


class Evaluated(NamedTuple):
    """What the metrics of a run need."""

    time: Array  # times, (n,) s
    error: Array  # x, y, psi of the ship minus those of the reference, as their messages give them, (n, 3)
    wrench: Array  # applied surge force [N] and yaw moment [N·m], (n, 2)
    command: Array  # the commanded ones, at the steps at which a control period begins, (m, 2)


class Control(NamedTuple):
    """What the controller has computed, a row for each control period."""

    stamps: Stamps  # times of the periods, (m,) ns
    terms: dict[str, Array]  # by the field names of ControlState.msg, m rows each
    estimate: Array | None  # x, y, psi, u, v, r of the observer, (m, 6); None without one
    published: Array | None  # the same as its message gives it, (m, 6); None without one


class Loop(ABC):
    """A closed loop on its way."""

    samples: int  # number of rows of the complete run
    done: int  # number of rows so far
    rows: Array  # its rows, by the columns of WIDTHS; those from `done` on have no meaning
    block: ClassVar[int]  # number of steps after which progress is reported

    @abstractmethod
    def advance(self, stop: int) -> None:
        """Go on until `stop` rows are done.

        Raises SimulationError if the motion is no longer finite; ControlError if the law is not defined at a state of the run.
        """

    @abstractmethod
    def control(self) -> Control:
        """What the controller has computed so far."""

    @abstractmethod
    def evaluated(self) -> Evaluated:
        """What the metrics of the steps so far need."""

    @abstractmethod
    def reference(self, count: int) -> Array:
        """The first published motions of the reference ship: x, y, psi, u, v, r, du, dv, dr, (count, 9)."""

    def columns(self) -> dict[str, Array]:
        """The rows so far by the names of WIDTHS."""
        parts = np.split(self.rows[: self.done], np.cumsum([*WIDTHS.values()])[:-1], axis=1)
        return dict(zip(WIDTHS, parts, strict=True))


@dataclass
class Desired:
    """The reference as the controller receives it: the latest published motion of the reference ship."""

    ship: Reference  # the generator of the reference trajectory
    grid: RateGrid  # the instants at which it is published
    published: list[tuple[Array, Array]] = field(default_factory=list)  # all states and accelerations so far, as published

    def at(self, stamp: int) -> tuple[Motion, Acceleration]:
        """State and acceleration at the latest published instant that is not after a stamp, ns."""
        index = self.grid.index(stamp)
        if isinstance(self.ship, FollowingReference):  # one period ahead, as in lockstep
            while len(self.published) <= index + 1:
                self.publish()
            state, acceleration = self.published[index]
            return as_published(state), as_acceleration(acceleration)
        while len(self.published) <= index:
            self.publish()
            state, acceleration = self.published[-1]
            self._received = as_published(state), as_acceleration(acceleration)
        return self._received

    def observe(self, stamp: int, measured: Motion) -> None:
        """Show odometry to a reference that follows the vessel, for the next step.

        Not the first one, which in lockstep may come before the node of the reference is connected.
        """
        if isinstance(self.ship, FollowingReference) and stamp:
            self.ship.observe((measured.x, measured.y))

    def publish(self) -> None:
        """Publish the state of the next instant."""
        if self.published:
            self.ship.advance()
        self.published.append((np.array(self.ship.state), np.array(self.ship.acceleration())))


class InterpretedLoop(Loop):
    """Plant, reference ship and controller as the nodes have them."""

    block = 1

    def __init__(self, scenario: Scenario, samples: int, law: Law[Any] | None = None) -> None:
        sim, controller = scenario.vessel_sim, scenario.controller
        self.samples, self.done = samples, 0
        self.rows = np.empty((samples, WIDTH))
        self._grid = RateGrid(sim.rate_hz)
        self._plant = make_plant(sim, self._grid.period)
        layout = scenario.thruster_allocation.vessel.thrusters
        self._allocation = Allocation(layout) if sim.by_thrusters else None
        self._vessel = sim.vessel.coefficients()
        grid = RateGrid(scenario.reference_ship.rate_hz)
        self._desired = Desired(make_reference(scenario.reference_ship, grid.period), grid)
        self._supervised = may_intervene(controller)
        self._loop = make_control_loop(controller, law, self._supervised)
        self._terms: list[tuple[int, Terms]] = []
        self._operations: list[tuple[int, int]] = []  # with the reasons, as the node states them
        self._estimates: list[Motion] = []

    def advance(self, stop: int) -> None:
        """Go on until `stop` rows are done."""
        while self.done < stop:
            wrench, disturbance = self._step(self._grid.stamp(self.done))
            self.done += 1
            if self.done < self.samples:  # the last sample is the final state
                self._plant.advance(wrench, disturbance)

    def _step(self, stamp: int) -> tuple[Wrench, Wrench]:
        """Compute one row, as in the nodes: the plant publishes, the controller answers. Returns the wrenches on the ship."""
        plant, loop = self._plant, self._loop
        time = seconds(stamp)
        disturbance = plant.disturbance(time)
        state = as_published(plant.state)
        sensed = plant.measured(stamp)
        measured = state if plant.odometry_is_true else as_published(sensed)
        reference, reference_acceleration = self._desired.at(stamp)
        self._desired.observe(stamp, measured)
        if loop.due(stamp):
            measured_at = self._grid.stamp(self.done - plant.periods_late)
            age = seconds(stamp - measured_at)
            desired = extrapolate(reference, reference_acceleration, -age)
            self._terms.append((stamp, loop.step(stamp, measured, desired, reference_acceleration, measured_at, age)))
            if self._supervised:
                self._operations.append((loop.supervision.operation, loop.supervision.reason))
            if loop.estimate is not None:
                self._estimates.append(loop.estimate)
        wrench = self._applied(stamp, measured.u)
        unforced, disturbing = plant.unforced_acceleration(), acceleration(disturbance, self._vessel)
        motion = (time, *state, *measured, *reference, wrench[0], wrench[2], *loop.wrench)
        self.rows[self.done] = (*motion, *disturbing, *unforced, plant.state[2], sensed[2], *disturbance, wrench[1])
        return wrench, disturbance

    def _applied(self, stamp: int, surge_speed: float) -> Wrench:
        """The wrench on the hull for the present command, given by actuators or by thrusters."""
        if self._allocation is None:
            wrench: Wrench = self._plant.applied(self._loop.wrench)
        else:
            given = self._allocation.step_at(stamp, self._loop.wrench, surge_speed)
            wrench = self._plant.applied_thrusts(given.thrust, given.angle)
        return wrench

    def control(self) -> Control:
        """What the controller has computed so far."""
        terms = {name: np.array([getattr(term, name) for _, term in self._terms]) for name in Terms._fields}
        if self._operations:
            terms |= dict(zip(("operation", "reason"), np.array(self._operations).T, strict=True))
        stamps = np.array([stamp for stamp, _ in self._terms], np.int64)
        if not self._estimates:
            return Control(stamps, terms, None, None)
        return Control(stamps, terms, np.array(self._estimates), np.array([as_published(each) for each in self._estimates]))

    def evaluated(self) -> Evaluated:
        """What the metrics of the steps so far need."""
        found = self.columns()
        # The controller commands at the start of its periods, and the command is held in between.
        due = np.isin(self._grid.stamps(self.done), [stamp for stamp, _ in self._terms])
        error = found["state"][:, :3] - found["reference"][:, :3]
        return Evaluated(found["time"][:, 0], error, found["wrench"], found["command"][due])

    def reference(self, count: int) -> Array:
        """The first published motions of the reference ship, (count, 9)."""
        while len(self._desired.published) < count:
            self._desired.publish()
        return np.array([(*state, *acceleration) for state, acceleration in self._desired.published[:count]])


class Recorded(NamedTuple):
    """Recorded inputs of the controller, a row for each odometry message, and the wrenches that it commands."""

    stamp: Stamps  # times of the steps that the messages belong to, (n,) ns
    due: NDArray[np.bool_]  # whether a control period begins, (n,)
    measured_at: Stamps  # times of the measurements, (n,) ns
    age: Array  # how much older than the messages' steps they are, (n,) s
    # motion, desired: x, y, psi, u, v, r of ship and reference, (n, 6)
    motion: Array
    desired: Array
    acceleration: Array  # du, dv, dr of the reference, (n, 3)
    wrench: Array  # commanded surge force [N] and yaw moment [N·m], (n, 2), to be written


def replay_controller(loop: ControlLoop, recorded: Recorded, span: range) -> None:
    """Compute the commands for a span of recorded messages. Raises ControlError if the law is not defined for one."""
    for k in span:
        if recorded.due[k]:
            motion, rate, age = as_motion(recorded.motion[k]), as_acceleration(recorded.acceleration[k]), float(recorded.age[k])
            desired = extrapolate(as_motion(recorded.desired[k]), rate, -age)
            loop.step(int(recorded.stamp[k]), motion, desired, rate, int(recorded.measured_at[k]), age)
        recorded.wrench[k] = loop.wrench
