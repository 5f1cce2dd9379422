"""The closed loop without ROS: the same plant, virtual ship and law, stepped in one process.

Values are exchanged between the parts as their messages would carry them, for instance the heading as a quaternion, so that a
lockstep run of the nodes gives bit-identical results. The laws of the package run
compiled, bit-identically; others run interpreted.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from vessel_hsmc_ros.control.interface.law import Law
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.core.kernel import Array, whole_periods
from vessel_hsmc_ros.core.metrics import Published, Run
from vessel_hsmc_ros.core.timing import RateGrid, seconds
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compiled_loop import make_loop

__all__ = ["ClosedLoop", "Run", "load_scenario", "simulate"]

Progress = Callable[[int, int], None]


class ClosedLoop:
    """Plant, reference ship and controller in one process, with everything that they publish.

    `interpreted`: run the plain Python text, also where it could be compiled; the numbers are the same.

    Attributes:
        samples: Number of odometry messages of the complete run.

    Raises:
        ScenarioError: the scenario has no duration, or scripted faults.
    """

    def __init__(self, scenario: Scenario, law: Law[Any] | None = None, interpreted: bool = False) -> None:
        sim = scenario.vessel_sim
        if scenario.faults:
            raise ScenarioError(f"{scenario.name} has faults, which only the nodes carry out: vessel-hsmc run")
        if sim.duration <= 0.0:
            raise ScenarioError("vessel_sim.duration must be above 0 s offline (got 0 s, which has no end)")
        self._grid = RateGrid(sim.rate_hz)
        self._reference_grid = RateGrid(scenario.reference_ship.rate_hz)
        self._has_truth = noisy(scenario)
        self._late = whole_periods(sim.sensors.delay, self._grid.period)
        self.samples = sample_count(sim.duration, self._grid)
        self._loop = make_loop(scenario, self.samples, law, interpreted)

    @property
    def done(self) -> int:
        """Number of steps completed so far."""
        return self._loop.done

    @property
    def time(self) -> float:
        """Simulated time of the last step, s."""
        return seconds(self._grid.stamp(max(self.done - 1, 0)))

    def run(self, progress: Progress | None = None) -> None:
        """Run to the end of the scenario.

        `progress`: called now and then, and at the end, with the number of samples done and their total number. Raises
        SimulationError if the motion is no longer finite; ControlError if the law is not defined at a state of the run.
        """
        loop = self._loop
        while loop.done < self.samples:
            try:
                loop.advance(min(loop.done + loop.block, self.samples))
            finally:  # also before an error: a block may have come some way
                if progress is not None:
                    progress(loop.done, self.samples)

    def result(self) -> Run:
        """The arrays of the run as far as it has come, one row for each odometry message."""
        columns, found = self._loop.columns(), self._loop.control()
        # As in the bag of a run: with a lag, the metrics of the commanded wrench are not those of the applied one.
        commanded = columns["command"][self._grid.indices(found.stamps[found.stamps <= self._grid.stamp(self.done - 1)])]
        control: dict[str, Array] = {
            "time": np.multiply(found.stamps, 1e-9, dtype=np.float64),
            **found.terms,
            "commanded": commanded,
        }
        if found.published is not None:
            control["estimate"] = found.published
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
        columns, found, grid = self._loop.columns(), self._loop.control(), self._reference_grid
        stamps = np.array([self._grid.stamp(k) for k in range(self.done)], np.int64)
        reference = self._loop.reference(grid.index(int(stamps[-1]) if self.done else -1) + 2)
        return Published(
            stamps,
            stamps[np.maximum(np.arange(self.done) - self._late, 0)],
            _with_heading(columns["measured"], columns["headings"][:, 1]),
            _with_heading(columns["state"], columns["headings"][:, 0]) if self._has_truth else None,
            columns["command"],
            np.insert(columns["wrench"], [1], columns["sway_force"], axis=1),
            columns["disturbing_wrench"],
            columns["unforced_acceleration"],
            np.array([grid.stamp(index) for index in range(len(reference))]),
            reference[:, :6],
            reference[:, 6:],
            found.stamps,
            found.terms,
            found.estimate,
        )


def simulate(scenario: Scenario, progress: Progress | None = None, law: Law[Any] | None = None, interpreted: bool = False) -> Run:
    """Run a scenario offline.

    Args:
        scenario: A scenario from `load_scenario`.
        progress: Called now and then, and at the end, with the number of samples done and their total number.
        law: An instance of a control law, also of your own, that replaces the scenario's; its period must be that of
            `controller.rate_hz`.
        interpreted: Run the plain Python text, also where it could be compiled; the numbers are the same.

    Returns:
        The arrays of the run, one row for each odometry message.

    Raises:
        ScenarioError: the scenario has no duration.
        SimulationError: the motion is no longer finite.
        ControlError: the law is not defined at a state of the run, or its code fails.
    """
    loop = ClosedLoop(scenario, law, interpreted)
    loop.run(progress)
    return loop.result()


def sample_count(duration: float, grid: RateGrid) -> int:
    """Number of odometry messages in a run: one for each step, and one for the start."""
    return round(duration * grid.rate_hz) + 1


def noisy(scenario: Scenario) -> bool:
    """Whether measurements differ from the state: sensors that are not perfect, or waves."""
    sim = scenario.vessel_sim
    return not sim.sensors.perfect() or bool(sim.disturbance.waves.significant_height)


def _with_heading(states: Array, heading: Array) -> Array:
    """States with another heading, (n, 6)."""
    return np.column_stack((states[:, :2], heading, states[:, 3:]))
