"""The reproduction of the paper: run every case, measure, draw the figures, test the claims, save the results.

Some cases need variants of the law for which no parameters exist: with the exact model of the ship, and with other constants.
"""

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import KernelLaw, Law
from vessel_hsmc_ros.control.interface.network import Estimates
from vessel_hsmc_ros.control.laws import hierarchical as repaired
from vessel_hsmc_ros.control.laws import hierarchical_parameters as repaired_parameters
from vessel_hsmc_ros.control.laws.hierarchical import HierarchicalController, guidance, turn_in_current
from vessel_hsmc_ros.control.laws.hierarchical_parameters import HierarchicalParameters, gains
from vessel_hsmc_ros.control.laws.hierarchical_printed import (
    Gains,
    HierarchicalPrintedController,
    HierarchicalPrintedParameters,
    StepTerms,
    control,
)
from vessel_hsmc_ros.control.laws.hierarchical_printed import gains as printed_gains
from vessel_hsmc_ros.core.exceptions import ControlError, RunError, SimulationError
from vessel_hsmc_ros.core.kernel import Array, clip, kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario, for_nodes, load_scenario
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies import batch, scenario_run
from vessel_hsmc_ros.studies.paper.cases import (
    CASES,
    CLAIMS,
    LAWS,
    NAN,
    PRINTED,
    REPAIRED,
    Case,
    Claim,
    Numbers,
    Results,
    claims_page,
    of_law,
)
from vessel_hsmc_ros.studies.paper.measure import CaseResult, LawNumbers, Repaired, measure, reduced_error

repaired_control = repaired.control  # a kernel calls others by their names in its module


class ExactConstants(NamedTuple):
    """Gains, and the coefficients of the ship."""

    gains: Gains
    ship: Vessel


class ExactMemory(NamedTuple):
    """The outputs of the networks, kept as weights: each is one neuron, constantly active, shape (3, 1)."""

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
    """The law as printed, (16) to (28), with f_u, f_v, f_r of (7) instead of the networks' outputs.

    `parameters`: gains of the law; its networks are not used.
    """

    kernel = staticmethod(step)
    terms = StepTerms
    networks = ("surge", "sway", "yaw")

    def __init__(self, parameters: HierarchicalPrintedParameters, known: KnownVessel, vessel: Vessel) -> None:
        self._ship = vessel
        super().__init__(parameters, known, math.nan)  # nothing adapts, so there is no period

    def retune(self, parameters: HierarchicalPrintedParameters) -> None:
        """Replace the gains."""
        self.constants = ExactConstants(printed_gains(parameters, self.vessel, self.period), self._ship)

    def reset(self) -> None:
        """There is no state to reset."""
        self.memory = ExactMemory(np.zeros((3, 1)))


class RepairedConstants(NamedTuple):
    """Gains of the repaired law, and the coefficients of the ship."""

    gains: repaired_parameters.Gains
    ship: Vessel


class RepairedMemory(NamedTuple):
    """The outputs of the networks, as in `ExactMemory`."""

    W: NDArray[np.float64]


class RepairedTerms(NamedTuple):
    """Errors, surfaces and estimates, by their names in `Terms`."""

    surge_error: float
    sway_error: float
    heading_error: float
    sway_surface: float
    heading_surface: float
    yaw_surface: float
    surge_surface: float
    surge_estimate: float
    sway_estimate: float
    yaw_estimate: float


@kernel
def repaired_step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: RepairedMemory, constants: RepairedConstants
) -> tuple[tuple[float, float], RepairedTerms, RepairedMemory]:
    """The limited wrench of the repaired law with exact network outputs, without a current; see `KernelLaw`."""
    g, still = constants.gains, (0.0, 0.0, 0.0)
    f_u, f_v, f_r = unforced_acceleration(motion.u, motion.v, motion.r, constants.ship)
    m.W[0, 0], m.W[1, 0], m.W[2, 0] = f_u, f_v, f_r
    n, turn = guidance(motion, desired, acceleration, g), turn_in_current(desired, acceleration, still, g)
    s = repaired_control(motion, n, turn, still, desired.u, Estimates(f_u, f_v, f_r), g)
    terms = RepairedTerms(n.e1, n.e2, n.psi_e, s.sigma1, s.sigma2, s.S1, s.S2, f_u, f_v, f_r)
    return (clip(s.tau_1, g.tau_1max), clip(s.tau_2, g.tau_2max)), terms, m


class ExactRepairedLaw(KernelLaw[HierarchicalParameters]):
    """The repaired law with f_u, f_v, f_r of (7) instead of the networks' outputs; the arguments are those of a law.

    `parameters`: numbers of the law; its networks are not used.
    """

    kernel = staticmethod(repaired_step)
    terms = RepairedTerms
    networks = ("surge", "sway", "yaw")

    def __init__(self, parameters: HierarchicalParameters, known: KnownVessel, period: float, vessel: Vessel) -> None:
        self._ship = vessel
        super().__init__(parameters, known, period)

    def retune(self, parameters: HierarchicalParameters) -> None:
        """Replace the gains."""
        self.constants = RepairedConstants(repaired_parameters.gains(parameters, self.vessel, self.period), self._ship)

    def reset(self) -> None:
        """There is no state to reset."""
        self.memory = RepairedMemory(np.zeros((3, 1)))


class AlteredLaw(HierarchicalController):
    """The repaired law with constants that no parameters give, such as adaptation gains of zero.

    `changes`: constants by their symbols in `Gains`, in SI units.
    """

    def __init__(
        self, parameters: HierarchicalParameters, vessel: KnownVessel, period: float, changes: Mapping[str, Any]
    ) -> None:
        self._changes = changes  # before super().__init__, which takes the gains for a model
        super().__init__(parameters, vessel, period)

    def _use(self, model: int) -> None:
        super()._use(model)
        self.constants = self.constants._replace(gains=self.constants.gains._replace(**self._changes))


Progress = Callable[[float], None]

ENDED_BY_SIGNAL = 128  # exit codes of a run above this mean that a signal ended it
FIRST, STRIDE = 300, 10  # a figure needs each of the first samples, where the transient is fast, and then every tenth
RATES = (PLANT, REFERENCE, CONTROLLER)

NO_PREDICTION: tuple[Array, Array] = (np.empty(0), np.empty(0))
"""What the reduced dynamics predict of a run that they do not describe."""


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
    """Run a case offline."""
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

    Returns the measured numbers and the thinned arrays, from the recorded bag.
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


def run_cases(cases: Sequence[Case], nodes: Path | None, progress: Progress) -> dict[str, CaseResult]:
    """Run cases in worker processes, or by the nodes where they can.

    Returns the results by the name of the case, in the order of the cases.
    """
    by_nodes = [case for case in cases if nodes is not None and case.by_nodes]
    # The longest cases first, so that no long one is left to a single worker at the end.
    offline = sorted((case for case in cases if case not in by_nodes), key=duration_of, reverse=True)
    results = batch.run_all(simulate_case, offline, on_progress=progress)
    by_name = {case.name: result for case, result in zip(offline, results, strict=True)}
    if nodes is not None:
        by_name |= _run_by_nodes(by_nodes, nodes, progress, sum(map(duration_of, offline)))
    return {case.name: by_name[case.name] for case in cases}


def _run_by_nodes(cases: Sequence[Case], parent: Path, progress: Progress, start: float) -> dict[str, CaseResult]:
    """Run cases by the nodes, one after the other; their progress counts from `start`."""
    results = {}
    for case in cases:
        folder = RunFolder(parent / case.name)
        folder.path.mkdir(parents=True)

        def add_progress(time: float, start: float = start) -> None:
            progress(start + time)

        # Nodes of a concurrent run in the same namespace would mix their topics with these.
        with scenario_run.reserve_namespace(""):
            results[case.name] = run_case_by_nodes(case, folder, add_progress)
        start += duration_of(case)
    return results


def write(results: Mapping[str, CaseResult], folder: Path, cases: Sequence[Case] = CASES) -> Results:
    """Write results.json, claims.md and the figures into a folder. Returns the numbers of every case, by name."""
    from vessel_hsmc_ros.studies.paper.figures import draw_all  # matplotlib is slow to import

    numbers = {name: result.numbers for name, result in results.items()}
    try:
        figures = folder / "figures"
        figures.mkdir(parents=True, exist_ok=True)
        (folder / "results.json").write_text(dump(numbers, cases), encoding="utf-8")
        (folder / "claims.md").write_text(claims_page(numbers), encoding="utf-8")
        draw_all(results, figures)
    except OSError as error:
        raise RunError(f"results cannot be written into {folder}: {error.strerror}") from None
    return numbers


def dump(results: Results, cases: Sequence[Case] = CASES) -> str:
    """All numbers as JSON text; NaN is left out, so that equal runs give equal bytes."""
    described: dict[str, Any] = {}
    for case in cases:
        numbers = dataclasses.asdict(results[case.name])
        described[case.name] = {
            "title": case.title,
            "scenario": case.scenario,
            "changes": {name: _finite(value) for name, value in case.changes.items()},
            **({"constants": dict(case.constants)} if case.constants else {}),
            "numbers": {name: value for name, value in numbers.items() if not math.isnan(value)},
        }
    document = {
        "cases": described,
        "claims": [
            {
                "place": claim.place,
                "claim": claim.statement,
                "required": claim.required,
                **{words: _outcome(claim, law, results) for law, words in LAWS.items()},
            }
            for claim in CLAIMS
        ],
    }
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def load(path: Path) -> dict[str, Numbers]:
    """Read the numbers of a results.json. Raises RunError if the file cannot be read."""
    try:
        cases = json.loads(path.read_text(encoding="utf-8"))["cases"]
        return {name: Numbers(**case["numbers"]) for name, case in cases.items()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunError(f"results {path} cannot be read: {error}") from None


def _outcome(claim: Claim, law: str, results: Results) -> dict[str, Any]:
    own = of_law(law, results)
    return {"measured": claim.measured(own), "holds": claim.holds(own), "answer": claim.answer(own, law)}


def _finite(value: object) -> object:
    """A value that JSON can hold."""
    return value if not isinstance(value, float) or math.isfinite(value) else str(value)
