"""The closed loop without ROS: the same plant, virtual ship and law, stepped in one process.

Values are exchanged between the parts as their messages would carry them, for instance the heading as a quaternion, so that a
lockstep run of the nodes gives bit-identical results.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.control_loop import ControlLoop
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_published
from vessel_hsmc_ros.core.run_data import Published, Run
from vessel_hsmc_ros.core.timing import RateGrid, seconds
from vessel_hsmc_ros.laws import Law, Terms
from vessel_hsmc_ros.reference.factory import Reference, make_reference
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, make_law, make_observer
from vessel_sim_node.disturbance import acceleration
from vessel_sim_node.simulator import Simulator

__all__ = ["ClosedLoop", "Run", "load_scenario", "simulate"]

Array = NDArray[np.float64]

WIDTHS = {
    **{"time": 1, "state": 6, "measured": 6, "reference": 6, "wrench": 2, "disturbance": 3, "unforced_acceleration": 3},
    **{"headings": 2, "command": 2, "disturbing_wrench": 3},
}
"""Columns of a row, first those of `Run`, with states as their messages give them; `headings` are those of the state and of
the measurement in the messages, not wrapped."""

Progress = Callable[[int, int], None]


@dataclass
class Desired:
    """The reference as the controller receives it: the latest published motion of the reference ship.

    Attributes:
        ship: The generator of the reference trajectory.
        grid: The instants at which it is published.
        published: All states and accelerations so far, as published.
    """

    ship: Reference
    grid: RateGrid
    published: list[tuple[Array, Array]] = field(default_factory=list)

    def at(self, stamp: int) -> tuple[Motion, Acceleration]:
        """State and acceleration at the latest published instant that is not after a stamp, ns."""
        while len(self.published) <= self.grid.index(stamp):
            self.publish()
            state, acceleration = self.published[-1]
            self._received = as_published(state), as_acceleration(acceleration)
        return self._received

    def publish(self) -> None:
        """Publish the state of the next instant."""
        if self.published:
            self.ship.advance()
        self.published.append((np.array(self.ship.state), np.array(self.ship.acceleration())))


class ClosedLoop:
    """Plant, reference ship and controller in one process, with everything that they publish.

    Args:
        scenario: A scenario from `load_scenario`.
        law: A control law that replaces the scenario's.

    Attributes:
        samples: Number of odometry messages of the complete run.
        done: Number of steps completed so far.

    Raises:
        ScenarioError: the scenario has no duration.
    """

    def __init__(self, scenario: Scenario, law: Law[Any] | None = None) -> None:
        sim, controller = scenario.vessel_sim, scenario.controller
        if sim.duration <= 0.0:
            raise ScenarioError("vessel_sim.duration = 0 s goes on for ever: offline it must be above 0 s")
        self._grid = RateGrid(sim.rate_hz)
        self._plant = Simulator(sim, self._grid.period)
        self._vessel = sim.vessel.coefficients()
        reference_grid = RateGrid(scenario.reference_ship.rate_hz)
        self._desired = Desired(make_reference(scenario.reference_ship, reference_grid.period), reference_grid)
        self._loop = ControlLoop(law or make_law(controller), RateGrid(controller.rate_hz), make_observer(controller))
        self.samples = sample_count(sim.duration, self._grid)
        self.done = 0
        self._rows = np.empty((self.samples, sum(WIDTHS.values())))
        self._terms: list[tuple[int, Terms]] = []
        self._estimates: list[Motion] = []

    @property
    def time(self) -> float:
        """Simulated time of the last step, s."""
        return seconds(self._grid.stamp(max(self.done - 1, 0)))

    def run(self, progress: Progress | None = None) -> None:
        """Run to the end of the scenario.

        Args:
            progress: Called after each sample with the number of samples done and their total number.

        Raises:
            SimulationError: the motion is no longer finite.
            ControlError: the law is not defined at a state of the run.
        """
        while self.done < self.samples:
            wrench, disturbance = self._step(self._grid.stamp(self.done))
            self.done += 1
            if self.done < self.samples:  # the last sample is the final state
                self._plant.advance(wrench, disturbance)
            if progress is not None:
                progress(self.done, self.samples)

    def _step(self, stamp: int) -> tuple[tuple[float, float], tuple[float, float, float]]:
        """Compute one row, as in the nodes: the plant publishes, the controller answers. Returns the wrenches on the ship."""
        plant, loop = self._plant, self._loop
        time = seconds(stamp)
        disturbance = plant.disturbance(time)
        state = as_published(plant.state)
        sensed = plant.measured(stamp)
        measured = state if plant.odometry_is_true else as_published(sensed)
        reference, reference_acceleration = self._desired.at(stamp)
        if loop.due(stamp):
            self._terms.append((stamp, loop.step(stamp, measured, reference, reference_acceleration)))
            if loop.estimate is not None:
                self._estimates.append(loop.estimate)
        wrench = plant.applied(loop.wrench)
        unforced, disturbing = plant.unforced_acceleration(), acceleration(disturbance, self._vessel)
        motion = (time, *state, *measured, *reference, *wrench, *disturbing, *unforced)
        self._rows[self.done] = (*motion, plant.state[2], sensed[2], *loop.wrench, *disturbance)
        return wrench, disturbance

    def result(self) -> Run:
        """The arrays of the run as far as it has come, one row for each odometry message."""
        columns = self._columns()
        control = {"time": np.array([seconds(stamp) for stamp, _ in self._terms]), **self._control()}
        # As in the bag of a run: with a lag, the metrics of the commanded wrench are not those of the applied one.
        steps = [self._grid.index(stamp) for stamp, _ in self._terms if self._grid.index(stamp) < self.done]
        control["commanded"] = columns["command"][steps]
        if self._estimates:
            control["estimate"] = np.array([as_published(estimate) for estimate in self._estimates])
        return Run(
            columns["time"][:, 0],
            columns["state"],
            columns["measured"],
            columns["reference"],
            columns["wrench"],
            columns["disturbance"],
            columns["unforced_acceleration"],
            control,
        )

    def published(self) -> Published:
        """The content of all messages of the run as far as it has come; in lockstep the reference ship is one period ahead."""
        columns, desired = self._columns(), self._desired
        stamps = np.array([self._grid.stamp(k) for k in range(self.done)], np.int64)
        last = int(stamps[-1]) if self.done else -1
        while len(desired.published) < desired.grid.index(last) + 2:
            desired.publish()
        states, accelerations = zip(*desired.published, strict=True)
        return Published(
            stamps,
            _with_heading(columns["measured"], columns["headings"][:, 1]),
            None if self._plant.odometry_is_true else _with_heading(columns["state"], columns["headings"][:, 0]),
            columns["command"],
            columns["wrench"],
            columns["disturbing_wrench"],
            columns["unforced_acceleration"],
            np.array([desired.grid.stamp(index) for index in range(len(states))]),
            np.array(states),
            np.array(accelerations),
            np.array([stamp for stamp, _ in self._terms], np.int64),
            self._control(),
            np.array(self._estimates) if self._estimates else None,
        )

    def _columns(self) -> dict[str, Array]:
        """The rows so far by the names of WIDTHS."""
        parts = np.split(self._rows[: self.done], np.cumsum([*WIDTHS.values()])[:-1], axis=1)
        return dict(zip(WIDTHS, parts, strict=True))

    def _control(self) -> dict[str, Array]:
        return {name: np.array([getattr(term, name) for _, term in self._terms]) for name in Terms._fields}


def simulate(scenario: Scenario, progress: Progress | None = None, law: Law[Any] | None = None) -> Run:
    """Run a scenario offline.

    Args:
        scenario: A scenario from `load_scenario`.
        progress: Called after each sample with the number of samples done and their total number.
        law: An instance of a control law, also of your own, that replaces the scenario's; its period must be that of
            `controller.rate_hz`.

    Returns:
        The arrays of the run, one row for each odometry message.

    Raises:
        ScenarioError: the scenario has no duration.
        SimulationError: the motion is no longer finite.
        ControlError: the law is not defined at a state of the run, or its code fails.
    """
    loop = ClosedLoop(scenario, law)
    loop.run(progress)
    return loop.result()


def sample_count(duration: float, grid: RateGrid) -> int:
    """Number of odometry messages in a run: one for each step, and one for the start."""
    return round(duration * grid.rate_hz) + 1


def _with_heading(states: Array, heading: Array) -> Array:
    """States with another heading, (n, 6)."""
    return np.column_stack((states[:, :2], heading, states[:, 3:]))
