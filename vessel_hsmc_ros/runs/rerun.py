"""Repetition of a recorded scenario with changed parameters, compared with the recorded run."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from vessel_hsmc_ros import report
from vessel_hsmc_ros.bags.reader import Bag
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.report.tables import metrics_table
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.run_folder import RunFolder, make_run_folder
from vessel_hsmc_ros.scenario.scenario import Scenario


@dataclass(frozen=True)
class Rerun:
    """A comparison of a recorded run with its repetition.

    Attributes:
        folder: Where its page and figures are.
        change: The changed parameters, as text.
        table: Metric, recorded value, repeated value, difference.
    """

    folder: RunFolder
    change: str
    table: list[tuple[str, str, str, str]]


def rerun(bag: Bag, changes: Mapping[str, object], namespace: str | None, output: Path) -> Rerun:
    """Run a bag's scenario offline with changed parameters, for as long as the recorded run lasted.

    Args:
        bag: A bag with a scenario.
        changes: Values by `node.parameter`.
        namespace: ROS namespace of the vessel, where the bag has several.
        output: Where to create the run folder.

    Returns:
        The comparison of the recorded run with its repetition.

    Raises:
        ScenarioError: the bag has no scenario, or the change contradicts it.
        ParameterError: a parameter is unknown or out of range.
        BagError: the bag lacks a topic that every run has.
    """
    from vessel_hsmc_ros.report import figures  # matplotlib takes a while to load

    # For as long as the recording: metrics of runs of different duration would not be comparable.
    scenario = _shortened(bag.scenario(dict(changes)), bag, namespace)
    recorded = replace(report.of_bag(bag.path, namespace), name="recorded")
    run = simulate(scenario)
    change = ", ".join(f"{name} = {value}" for name, value in changes.items())
    repeated = report.with_verdict(report.Record(f"with {change}", run, measured(run, scenario), scenario=scenario))
    folder = make_run_folder(output, f"{scenario.name}_again")
    folder.write_parameters(scenario)
    report.write(folder.report, [recorded, repeated], f"{scenario.name}, recorded and with {change}")
    figures.draw([recorded, repeated], folder.figures)
    return Rerun(folder, change, _table(recorded, repeated))


def _table(recorded: report.Record, repeated: report.Record) -> list[tuple[str, str, str, str]]:
    """The metrics that both runs have, and their differences."""
    table = metrics_table([recorded, repeated])
    return [(row.label, row.text(0), row.text(1), row.difference(1)) for row in table if None not in row.values]


def _shortened(scenario: Scenario, bag: Bag, namespace: str | None) -> Scenario:
    """The scenario with the duration of the recording, where that ended earlier than planned."""
    stamps = bag.topics[f"{bag.namespace(namespace)}odom"].stamp
    recorded = seconds(int(stamps.max() - stamps.min())) if len(stamps) else 0.0
    planned = scenario.vessel_sim.duration
    if planned and planned <= recorded:
        return scenario
    return replace(scenario, vessel_sim=replace(scenario.vessel_sim, duration=recorded))
