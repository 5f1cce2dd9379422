"""The C++ program of benchmarks/scalar: compiling it, writing its input, running it."""

import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from vessel_hsmc_ros import load_scenario
from vessel_hsmc_ros.core.kinematics import as_published
from vessel_hsmc_ros.guidance.factory import trajectory
from vessel_hsmc_ros.plant.simulator import Simulator
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law

if TYPE_CHECKING:
    from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedController

SOURCE = Path(__file__).parent / "scalar" / "case2.cpp"
COMPILE = ["g++", "-O3", "-march=native", "-o"]


class Scalar:
    """The C++ program, compiled, and its input.

    Args:
        folder: Where to put both.
    """

    def __init__(self, folder: Path) -> None:
        self._program, self._input = folder / "case2", folder / "input"
        subprocess.run([*COMPILE, str(self._program), str(SOURCE)], check=True)
        scenario = load_scenario("case2_tracking")
        write_input(scenario, self._input)

    def start(self, runs: int) -> "subprocess.Popen[str]":
        """Start it."""
        return subprocess.Popen([self._program, self._input, str(runs)], stdout=subprocess.PIPE, text=True)

    def results(self, runs: int) -> list[float]:
        """Run it: processor time of a step [ns], and of the last run the final state, rms and largest position error."""
        return [float(word) for word in self.start(runs).communicate()[0].split()]


def write_input(scenario: Scenario, path: Path) -> None:
    """Write the constants and the reference for the C++ program."""
    sim = scenario.vessel_sim
    plant, law = (
        Simulator(sim, 1.0 / sim.rate_hz).constants(),
        cast("HierarchicalPrintedController", make_law(scenario.controller)).constants,
    )
    count = samples(scenario)
    reference = trajectory(scenario.reference_ship, scenario.reference_ship.rate_hz, count)
    reference[:, 2] = [as_published(row[:6]).psi for row in reference]
    actuators = [float(value) for actuator in (plant.surge, plant.yaw) for value in actuator[:4]]
    gains, neurons = law.gains[:15], law.neurons
    constants = [*plant.vessel[:12], *plant.periodic, *actuators, *gains, *neurons.axis, neurons.delta, plant.step]
    numbers = [*constants, *sim.initial_pose, *sim.initial_velocity, float(count)]
    path.write_bytes(np.array(numbers).tobytes() + reference.tobytes())


def samples(scenario: Scenario) -> int:
    """Number of steps of a run."""
    return round(scenario.vessel_sim.duration * scenario.vessel_sim.rate_hz) + 1
