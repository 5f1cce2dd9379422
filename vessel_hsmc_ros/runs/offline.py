"""The closed loop without ROS: the same plant, virtual ship and law, stepped in one process.

Values are exchanged between the parts as their messages would carry them, for instance the heading as a quaternion, so that a
lockstep run of the nodes gives bit-identical results.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.control_loop import ControlLoop
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_acceleration, as_published
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.core.timing import RateGrid, seconds
from vessel_hsmc_ros.laws import Law, Terms
from vessel_hsmc_ros.reference.factory import Reference, make_reference
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, make_law, make_observer
from vessel_sim_node.disturbance import acceleration
from vessel_sim_node.simulator import Simulator

__all__ = ["Run", "load_scenario", "simulate"]

Array = NDArray[np.float64]

WIDTHS = (1, 6, 6, 6, 2, 3, 3)
"""Columns of time, state, measured, reference, wrench, disturbance and unforced acceleration."""


@dataclass
class Desired:
    """The reference as the controller receives it: the latest published motion of the reference ship.

    Attributes:
        ship: The generator of the reference trajectory.
        grid: The instants at which it is published.
        index: Index of the latest published instant; -1 before the first one.
    """

    ship: Reference
    grid: RateGrid
    index: int = -1

    def at(self, stamp: int) -> tuple[Motion, Acceleration]:
        """State and acceleration at the latest published instant that is not after a stamp, ns."""
        while self.index < self.grid.index(stamp):
            if self.index >= 0:
                self.ship.advance()
            self.index += 1
            self._published = as_published(self.ship.state), as_acceleration(self.ship.acceleration())
        return self._published


def simulate(scenario: Scenario, progress: Callable[[int, int], None] | None = None, law: Law[Any] | None = None) -> Run:
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
    sim = scenario.vessel_sim
    if sim.duration <= 0.0:
        raise ScenarioError("vessel_sim.duration = 0 s goes on for ever: offline it must be above 0 s")
    grid = RateGrid(sim.rate_hz)
    plant = Simulator(sim, grid.period)
    vessel = sim.vessel.coefficients()
    reference_grid = RateGrid(scenario.reference_ship.rate_hz)
    desired = Desired(make_reference(scenario.reference_ship, reference_grid.period), reference_grid)
    observer = make_observer(scenario.controller)
    loop = ControlLoop(law or make_law(scenario.controller), RateGrid(scenario.controller.rate_hz), observer)

    samples = sample_count(sim.duration, grid)
    rows = np.empty((samples, sum(WIDTHS)))
    terms: list[tuple[float, Terms]] = []
    estimates: list[Motion] = []
    # As in the nodes: the plant publishes, the controller answers, and the plant applies the answer in the same step.
    for k in range(samples):
        stamp = grid.stamp(k)
        time = seconds(stamp)
        disturbance = plant.disturbance(time)
        state = as_published(plant.state)
        measured = state if plant.odometry_is_true else as_published(plant.measured(stamp))
        reference, reference_acceleration = desired.at(stamp)
        if loop.due(stamp):
            terms.append((time, loop.step(stamp, measured, reference, reference_acceleration)))
            if loop.estimate is not None:
                estimates.append(as_published(loop.estimate))
        wrench = plant.applied(loop.wrench)
        unforced = plant.unforced_acceleration()
        rows[k] = (time, *state, *measured, *reference, *wrench, *acceleration(disturbance, vessel), *unforced)
        if k + 1 < samples:  # the last sample is the final state
            plant.advance(wrench, disturbance)
        if progress is not None:
            progress(k + 1, samples)
    return _run(rows, terms, estimates)


def sample_count(duration: float, grid: RateGrid) -> int:
    """Number of odometry messages in a run: one for each step, and one for the start."""
    return round(duration * grid.rate_hz) + 1


def _run(rows: Array, terms: Sequence[tuple[float, Terms]], estimates: Sequence[Motion]) -> Run:
    """Assemble a run from its rows of WIDTHS columns, the law's terms with their times, and the observer's estimates."""
    control = {"time": np.array([time for time, _ in terms])}
    for name in Terms._fields:
        control[name] = np.array([getattr(term, name) for _, term in terms])
    if estimates:
        control["estimate"] = np.array(estimates)
    time, state, measured, reference, wrench, disturbance, unforced = np.split(rows, np.cumsum(WIDTHS)[:-1], axis=1)
    return Run(time[:, 0], state, measured, reference, wrench, disturbance, unforced, control)
