"""Runs a fleet by the nodes, and writes its run folder: one bag, a page with all tracks, figures, a summary of every vessel."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from vessel_hsmc_ros.scenario.fleet import Fleet, dump_fleet
from vessel_hsmc_ros.scenario.run_folder import RunFolder, origin_of
from vessel_hsmc_ros.studies.runs.scenario_run import (
    Progress,
    Result,
    reserve_namespace,
    summarise,
    supervisor_module,
    write_page,
    write_results,
)

if TYPE_CHECKING:
    from vessel_hsmc_ros.report import Record


@contextmanager
def reserve_namespaces(fleet: Fleet) -> Iterator[None]:
    """A context in which no other run on this machine uses a namespace of the fleet; in lockstep, nor its /clock.

    Raises RunError if ROS is not installed, or another run uses them.
    """
    with ExitStack() as held:
        for number, namespace in enumerate(fleet.vessels):
            held.enter_context(reserve_namespace(namespace, fleet.lockstep and number == 0))
        yield


def run_fleet(fleet: Fleet, folder: RunFolder, progress: Progress, with_page: bool = True) -> Result:
    """Run a fleet by the real nodes over ROS 2 and record it into one bag.

    Returns the result; a failed run is a result with a nonzero exit code. Raises RunError if ROS is not installed.
    """
    supervisor = supervisor_module()
    origin = origin_of(fleet.base, "lockstep" if fleet.lockstep else "real time", "")
    folder.write_text_of_parameters(dump_fleet(fleet.with_bag(folder.bag.absolute(), folder.parameters.absolute())))
    status = supervisor.supervise(folder, fleet.base, "", progress, vessels=tuple(fleet.vessels))
    result = Result(folder, status.code, status.failure, facts={"vessels": {}})
    summarise(result, origin, lambda: _evaluate(result, origin, with_page))
    return result


def _evaluate(result: Result, origin: Mapping[str, Any], with_page: bool) -> None:
    """Evaluate the bag, and write the summary, and page and figures if they are wanted."""
    from vessel_hsmc_ros import report  # takes longer to import than the nodes take to start
    from vessel_hsmc_ros.bags.reader import open_bag

    shown = {name: origin[name] for name in report.ORIGIN if origin[name] not in (None, "")}
    result.records = report.of_fleet(open_bag(result.folder.bag), shown)
    result.facts["vessels"] = by_vessel(result.records)
    write_results(result, origin)
    if with_page:
        write_page(result.folder, result.records, f"{origin['scenario']}, {len(result.records)} vessels")


def by_vessel(records: Sequence["Record"]) -> dict[str, Any]:
    """The metrics and facts of each vessel, for run.json."""
    return {each.name: {"metrics": each.metrics._asdict() if each.metrics else None, **each.facts} for each in records}
