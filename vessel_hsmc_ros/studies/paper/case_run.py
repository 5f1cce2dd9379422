"""Run and measure one case of the paper, offline or by the nodes."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.law import Law
from vessel_hsmc_ros.control.laws.hierarchical_parameters import gains
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedController, HierarchicalPrintedParameters
from vessel_hsmc_ros.core.exceptions import ControlError, RunError, SimulationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario, for_nodes, load_scenario
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.paper.cases import PRINTED, REPAIRED, Case
from vessel_hsmc_ros.studies.paper.measure import LawNumbers, Repaired, measure
from vessel_hsmc_ros.studies.paper.numbers import NAN, Numbers
from vessel_hsmc_ros.studies.paper.reduced import reduced_error
from vessel_hsmc_ros.studies.paper.special_laws import AlteredLaw, ExactModelLaw, ExactRepairedLaw
from vessel_hsmc_ros.studies.runs import scenario_run

Progress = Callable[[float], None]

ENDED_BY_SIGNAL = 128  # exit codes of a run above this mean that a signal ended it
FIRST, STRIDE = 300, 10  # a figure needs each of the first samples, where the transient is fast, and then every tenth
RATES = (PLANT, REFERENCE, CONTROLLER)

NO_PREDICTION: tuple[Array, Array] = (np.empty(0), np.empty(0))
"""What the reduced dynamics predict of a run that they do not describe."""


@dataclasses.dataclass(frozen=True)
class CaseResult:
    """The results of a case."""

    numbers: Numbers  # the measured values
    run: Run  # its arrays, thinned for drawing, without the network weights
    # times and lateral errors that the reduced dynamics predict; empty for other laws than the paper's
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

    `progress`: called with the simulated time. Raises SimulationError, ControlError if the loop diverges although the case is
    not expected to.
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

    `progress`: called with the simulated time. Returns the measured numbers and the thinned arrays, from the recorded bag.
    Raises RunError if a node failed; KeyboardInterrupt if the run was interrupted; BagError if the bag cannot be read.
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

    `ended_at`: the time at which the run diverged, s; NaN if it did not. Returns the measured numbers, the thinned arrays and
    the prediction of the reduced dynamics.
    """
    vessel = scenario.vessel_sim.vessel.coefficients()
    law = law_numbers(case, scenario)
    reduced = reduced_error(run, vessel, law) if isinstance(law, HierarchicalPrintedParameters) else NO_PREDICTION
    numbers = dataclasses.replace(measure(run, vessel, law, reduced), ended_at=ended_at)
    return CaseResult(numbers, thinned(run), NO_PREDICTION if case.ends else reduced)


def law_numbers(case: Case, scenario: Scenario) -> LawNumbers:
    """What the surfaces of a run are measured with: the parameters of the law as printed, the constants of the repaired one."""
    controller = scenario.controller
    if controller.law == REPAIRED:
        constants = gains(controller.hierarchical, controller.vessel, 1.0 / controller.rate_hz)._replace(**case.constants)
        return Repaired(constants, controller.hierarchical.network)
    return controller.hierarchical_printed if controller.law == PRINTED else None


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
    if controller.law == REPAIRED:
        numbers = controller.hierarchical, controller.vessel, 1.0 / controller.rate_hz
        if case.exact:
            return ExactRepairedLaw(*numbers, vessel)
        return AlteredLaw(*numbers, case.constants) if case.constants else None
    if case.exact:
        return ExactModelLaw(controller.hierarchical_printed, controller.vessel, vessel)
    if case.rate_hz:
        # Constructed for a stable period: its constructor would reject the unstable one. Only the Euler step of the weights
        # uses it.
        return HierarchicalPrintedController(controller.hierarchical_printed, controller.vessel, 0.01)
    return None
