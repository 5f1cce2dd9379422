"""One case of the paper run and measured, offline or by the nodes."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ControlError, RunError, SimulationError
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.laws import Law
from vessel_hsmc_ros.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.paper.cases import Case
from vessel_hsmc_ros.paper.exact import ExactModelLaw
from vessel_hsmc_ros.paper.measure import measure, reduced_error
from vessel_hsmc_ros.paper.numbers import NAN, Numbers
from vessel_hsmc_ros.runs import scenario_run
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario, for_nodes, load_scenario

Array = NDArray[np.float64]
Progress = Callable[[float], None]

INTERRUPTED = 128
"""Exit codes of a run above this say that a signal ended it."""

FIRST, STRIDE = 300, 10
"""A figure needs every one of the first samples, and then every tenth."""

RATES = ("vessel_sim", "reference_ship", "controller")


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes:
        numbers: What was measured.
        run: Its arrays, thinned for drawing, without the weights.
        reduced: Times and lateral errors that the reduced dynamics predict; empty for other laws than the paper's.
    """

    numbers: Numbers
    run: Run
    reduced: tuple[Array, Array]


def scenario_of(case: Case, nodes: bool = False) -> Scenario:
    """The scenario a case runs, changed for nodes or for this process."""
    changes = dict(case.changes) | (for_nodes(recorded=True, real_time=False) if nodes else {})
    scenario = load_scenario(case.scenario, changes)
    if case.rate_hz:
        # Behind load_scenario's back, which refuses the law at this rate.
        parts = {node: dataclasses.replace(getattr(scenario, node), rate_hz=case.rate_hz) for node in RATES}
        scenario = dataclasses.replace(scenario, **parts)
    return scenario


def run_offline(case: Case, progress: Progress) -> Outcome:
    """Run a case in this process.

    Args:
        case: Any.
        progress: Called with the simulated time, s.

    Raises:
        SimulationError, ControlError: the loop cannot go on, and the case did not say so.
    """
    scenario = scenario_of(case)
    sim = scenario.vessel_sim
    done = [0]

    def count(samples: int, _: int) -> None:
        done[0] = samples
        progress((samples - 1) / sim.rate_hz)

    try:
        return outcome(case, scenario, simulate(scenario, count, _law(case, scenario)))
    except (SimulationError, ControlError):
        if not case.ends:
            raise
    # What it came to is measured up to a second before its end, or a tenth of a short run.
    ended_at = done[0] / sim.rate_hz
    before = dataclasses.replace(scenario, vessel_sim=dataclasses.replace(sim, duration=ended_at - min(1.0, 0.1 * ended_at)))
    run = simulate(before, None, _law(case, scenario))
    progress(sim.duration)
    return outcome(case, scenario, run, ended_at)


def run_by_nodes(case: Case, folder: RunFolder, progress: Progress) -> Outcome:
    """Run a case by the nodes over ROS 2; the run's folder keeps its bag.

    Raises:
        RunError: the run did not end as it should.
        KeyboardInterrupt: it was interrupted.
        BagError: its bag cannot be read.
    """
    from vessel_hsmc_ros.bags.reader import open_bag  # rosbags takes longer to load than the rest

    scenario = scenario_of(case, nodes=True)
    result = scenario_run.run_nodes(scenario, folder, "", progress)
    if result.exit_code > INTERRUPTED:
        raise KeyboardInterrupt
    if result.failure:
        raise RunError(f"case {case.name}: {result.failure}")
    run = open_bag(folder.bag).run(scenario.vessel_sim.vessel.coefficients())
    return outcome(case, scenario, run)


def outcome(case: Case, scenario: Scenario, run: Run, ended_at: float = NAN) -> Outcome:
    """Measure a run and thin it."""
    vessel = scenario.vessel_sim.vessel.coefficients()
    gains = scenario.controller.hierarchical if scenario.controller.law == "hierarchical" else None
    numbers = dataclasses.replace(measure(run, vessel, gains), ended_at=ended_at)
    reduced = (np.empty(0), np.empty(0)) if gains is None or case.ends else reduced_error(run, vessel, gains)
    return Outcome(numbers, thinned(run), reduced)


def thinned(run: Run) -> Run:
    """The samples that a figure needs, and of the law's terms those that are one number each."""

    def pick(samples: int) -> NDArray[np.int64]:
        return np.unique(np.r_[0 : min(FIRST, samples), 0:samples:STRIDE, samples - 1])

    rows = pick(len(run.time))
    control = {name: values[pick(len(values))] for name, values in run.control.items() if values.ndim == 1}
    arrays = {f.name: getattr(run, f.name)[rows] for f in dataclasses.fields(run) if f.name != "control"}
    return Run(**arrays, control=control)


def nodes_folder(parent: Path, case: Case) -> RunFolder:
    """A new folder for a case's run by the nodes."""
    path = parent / case.name
    path.mkdir(parents=True)
    return RunFolder(path)


def _law(case: Case, scenario: Scenario) -> Law[Any] | None:
    """The law that no scenario can ask for; None for the scenario's own."""
    controller, vessel = scenario.controller, scenario.vessel_sim.vessel.coefficients()
    if case.exact:
        return ExactModelLaw(controller.hierarchical, controller.vessel, vessel)
    if case.rate_hz:
        return HierarchicalController(controller.hierarchical, controller.vessel, 0.01)
    return None
