"""A recorded scenario run again with a change, and both runs side by side."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from vessel_hsmc_ros import report
from vessel_hsmc_ros.bags.reader import Bag
from vessel_hsmc_ros.core.metrics import evaluate
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.report.tables import key_figures
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.run_folder import RunFolder, make_run_folder
from vessel_hsmc_ros.scenario.scenario import Scenario


@dataclass(frozen=True)
class Rerun:
    """Both runs in words, and where their figures are.

    Attributes:
        change: What is different, in words.
        table: Key figure, recorded, again, difference.
    """

    folder: RunFolder
    change: str
    table: list[tuple[str, str, str, str]]


def rerun(bag: Bag, changes: Mapping[str, object], namespace: str | None, output: Path) -> Rerun:
    """Run a bag's scenario offline with changed parameters, for as long as the recorded run took.

    Args:
        bag: With a scenario.
        changes: Values by `node.parameter`.
        namespace: The vessel's, where the bag has several.
        output: Where to make the run folder.

    Raises:
        ScenarioError: the bag does not know its scenario, or the change contradicts it.
        ParameterError: a parameter is unknown or out of range.
        BagError: the bag has no run.
    """
    from vessel_hsmc_ros.report import figures  # matplotlib takes a while to load

    scenario = _ending(bag.scenario(dict(changes)), bag, namespace)
    recorded = report.of_bag(bag.path, namespace)
    run = simulate(scenario)
    told = ", ".join(f"{name} = {value}" for name, value in changes.items())
    measured = evaluate(run.time, run.state, run.reference, run.wrench)
    again = report.Record(f"with {told}", report.of_run(run), measured, scenario=scenario)
    recorded = replace(recorded, name="recorded")
    folder = make_run_folder(output, f"{scenario.name}_again")
    folder.write_parameters(scenario)
    report.write(folder.report, [recorded, again], f"{scenario.name}, recorded and with {told}")
    figures.draw([recorded, again], folder.figures)
    table = [_row(line) for line in key_figures([recorded, replace(again, facts={})]) if line["cells"][1]["text"] != "–"]
    return Rerun(folder, told, table)


def _row(line: Mapping[str, object]) -> tuple[str, str, str, str]:
    first, second, difference = (cell["text"] for cell in line["cells"])  # type: ignore[attr-defined]
    return str(line["label"]), first, second, difference


def _ending(scenario: Scenario, bag: Bag, namespace: str | None) -> Scenario:
    """The scenario with the duration of what was recorded, where it was shorter than planned."""
    stamps = bag.topics[f"{bag.namespace(namespace)}odom"].stamp
    lasted = seconds(int(stamps.max() - stamps.min())) if len(stamps) else 0.0
    planned = scenario.vessel_sim.duration
    if planned and planned <= lasted:
        return scenario
    return replace(scenario, vessel_sim=replace(scenario.vessel_sim, duration=lasted))
