"""Run and measure one case of the paper, offline or by the nodes."""

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import ControlError, RunError, SimulationError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.law.kernel_law import KernelLaw
from vessel_hsmc_ros.law.known_vessel import KnownVessel
from vessel_hsmc_ros.law.law import Law
from vessel_hsmc_ros.law.network import Estimates
from vessel_hsmc_ros.laws.hierarchical_printed import (
    Gains,
    HierarchicalPrintedController,
    HierarchicalPrintedParameters,
    StepTerms,
    control,
    gains,
)
from vessel_hsmc_ros.paper.cases import Case
from vessel_hsmc_ros.paper.measure import measure, reduced_error
from vessel_hsmc_ros.paper.numbers import NAN, Numbers
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration
from vessel_hsmc_ros.runs import scenario_run
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario, for_nodes, load_scenario

Progress = Callable[[float], None]

ENDED_BY_SIGNAL = 128
"""Exit codes of a run above this mean that a signal ended it."""

FIRST, STRIDE = 300, 10
"""A figure needs each of the first samples, where the transient is fast, and then every tenth."""

RATES = (PLANT, REFERENCE, CONTROLLER)


@dataclasses.dataclass(frozen=True)
class CaseResult:
    """The results of a case.

    Attributes:
        numbers: The measured values.
        run: Its arrays, thinned for drawing, without the network weights.
        reduced: Times and lateral errors that the reduced dynamics predict; empty for other laws than the paper's.
    """

    numbers: Numbers
    run: Run
    reduced: tuple[Array, Array]


def scenario_of(case: Case, nodes: bool = False) -> Scenario:
    """The scenario of a case, for the nodes or for a run in this process."""
    # The nodes take a scenario with a recorder; the offline loop needs none.
    changes = dict(case.changes) | (for_nodes(recorded=True, real_time=False) if nodes else {})
    scenario = load_scenario(case.scenario, changes)
    if case.rate_hz:
        # load_scenario refuses a rate at which the law is unstable, so the rate is replaced after its checks.
        parts = {node: dataclasses.replace(getattr(scenario, node), rate_hz=case.rate_hz) for node in RATES}
        scenario = dataclasses.replace(scenario, **parts)
    return scenario


def duration_of(case: Case) -> float:
    """The simulated time that a case takes."""
    return scenario_of(case).vessel_sim.duration


def simulate_case(case: Case, progress: Progress) -> CaseResult:
    """Run a case offline.

    Args:
        case: The case.
        progress: Called with the simulated time.

    Raises:
        SimulationError, ControlError: the loop diverges although the case is not expected to.
    """
    scenario = scenario_of(case)
    sim = scenario.vessel_sim
    samples = 0

    def count(done: int, _total: int) -> None:
        nonlocal samples
        samples = done
        progress((done - 1) / sim.rate_hz)

    try:
        return evaluate_case(case, scenario, simulate(scenario, count, _special_law(case, scenario)))
    except (SimulationError, ControlError) as error:
        if not case.ends:
            raise
        # A motion that is no longer finite ends the step after the last row, an undefined law the step of the next row.
        ended_at = (samples - isinstance(error, SimulationError)) / sim.rate_hz
    # A diverging run is measured up to one second before its end, or up to 90 % of a run shorter than ten seconds.
    before = dataclasses.replace(scenario, vessel_sim=dataclasses.replace(sim, duration=ended_at - min(1.0, 0.1 * ended_at)))
    run = simulate(before, None, _special_law(case, scenario))
    progress(sim.duration)
    return evaluate_case(case, scenario, run, ended_at)


def run_case_by_nodes(case: Case, folder: RunFolder, progress: Progress) -> CaseResult:
    """Run a case by the nodes over ROS 2; its bag stays in the run folder.

    Args:
        case: A case that nodes can run.
        folder: The run folder.
        progress: Called with the simulated time.

    Returns:
        The measured numbers and the thinned arrays, from the recorded bag.

    Raises:
        RunError: a node failed.
        KeyboardInterrupt: the run was interrupted.
        BagError: the bag cannot be read.
    """
    from vessel_hsmc_ros.bags.reader import open_bag  # rosbags takes longer to import than the rest

    scenario = scenario_of(case, nodes=True)
    result = scenario_run.run_nodes(scenario, folder, "", progress)
    if result.exit_code > ENDED_BY_SIGNAL:
        raise KeyboardInterrupt
    if result.failure:
        raise RunError(f"case {case.name}: {result.failure}")
    return evaluate_case(case, scenario, open_bag(folder.bag).run())


def evaluate_case(case: Case, scenario: Scenario, run: Run, ended_at: float = NAN) -> CaseResult:
    """Measure a run and reduce its arrays to the samples that the figures need.

    Args:
        case: The case that was run.
        scenario: The scenario of the run.
        run: Its arrays.
        ended_at: The time at which the run diverged, s; NaN if it did not.

    Returns:
        The measured numbers, the thinned arrays and the prediction of the reduced dynamics.
    """
    vessel = scenario.vessel_sim.vessel.coefficients()
    gains = scenario.controller.hierarchical_printed if scenario.controller.law == "hierarchical_printed" else None
    reduced = (np.empty(0), np.empty(0)) if gains is None else reduced_error(run, vessel, gains)
    numbers = dataclasses.replace(measure(run, vessel, gains, reduced), ended_at=ended_at)
    return CaseResult(numbers, thinned(run), (np.empty(0), np.empty(0)) if case.ends else reduced)


def thinned(run: Run) -> Run:
    """The samples that a figure needs, and the scalar ones among the law's terms."""

    def pick(samples: int) -> NDArray[np.int64]:
        # unique sorts and removes the overlap of the three ranges; the last sample is always included.
        return np.unique(np.r_[0 : min(FIRST, samples), 0:samples:STRIDE, samples - 1])

    rows = pick(len(run.time))
    # The terms of the law have a row per control period, not per odometry message, hence their own selection.
    control = {name: values[pick(len(values))] for name, values in run.control.items() if values.ndim == 1}
    arrays = {f.name: getattr(run, f.name)[rows] for f in dataclasses.fields(run) if f.name != "control"}
    return Run(**arrays, control=control)


def make_case_folder(parent: Path, case: Case) -> RunFolder:
    """Make a run folder for a case."""
    path = parent / case.name
    path.mkdir(parents=True)
    return RunFolder(path)


def _special_law(case: Case, scenario: Scenario) -> Law[Any] | None:
    """The law of a case for which no scenario exists; None for the scenario's own law."""
    controller, vessel = scenario.controller, scenario.vessel_sim.vessel.coefficients()
    if case.exact:
        return ExactModelLaw(controller.hierarchical_printed, controller.vessel, vessel)
    if case.rate_hz:
        # Constructed for a stable period: its constructor would reject the unstable one. Only the Euler step of the weights
        # uses it.
        return HierarchicalPrintedController(controller.hierarchical_printed, controller.vessel, 0.01)
    return None


class ExactConstants(NamedTuple):
    """Gains, and the coefficients of the ship."""

    gains: Gains
    ship: Vessel


class ExactMemory(NamedTuple):
    """The outputs of the networks in the place of weights: each is one neuron, constantly active, shape (3, 1)."""

    W: NDArray[np.float64]


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: ExactMemory, constants: ExactConstants
) -> tuple[tuple[float, float], StepTerms, ExactMemory]:
    """The wrench (22), (28) with exact network outputs; see `KernelLaw`."""
    f_u, f_v, f_r = unforced_acceleration(motion.u, motion.v, motion.r, constants.ship)
    m.W[0, 0], m.W[1, 0], m.W[2, 0] = f_u, f_v, f_r
    wrench, terms = control(motion, desired, acceleration, Estimates(f_u, f_v, f_r), constants.gains)
    return wrench, terms, m


class ExactModelLaw(KernelLaw[HierarchicalPrintedParameters]):
    """(16) to (28) with f_u, f_v, f_r of (7) in the place of the networks' outputs.

    Args:
        parameters: Gains of the law; its networks are not used.
        known: The model parameters that the law knows.
        vessel: The plant's coefficients.
    """

    kernel = staticmethod(step)
    terms = StepTerms
    networks = ("surge", "sway", "yaw")

    def __init__(self, parameters: HierarchicalPrintedParameters, known: KnownVessel, vessel: Vessel) -> None:
        self._ship = vessel
        super().__init__(parameters, known, math.nan)  # nothing adapts, so there is no period

    def retune(self, parameters: HierarchicalPrintedParameters) -> None:
        """Replace the gains."""
        self.constants = ExactConstants(gains(parameters, self.vessel, self.period), self._ship)

    def reset(self) -> None:
        """There is no state to reset."""
        self.memory = ExactMemory(np.zeros((3, 1)))
