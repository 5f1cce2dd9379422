"""Runs a fleet by the nodes, and writes its run folder: one bag, a page with all tracks, figures, a summary of every vessel."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from vessel_hsmc_ros.core.exceptions import BagError, ReportError, RunError
from vessel_hsmc_ros.runs.scenario_run import Progress, reserve_namespace, supervisor_module, write_page
from vessel_hsmc_ros.scenario.fleet import Fleet, dump_fleet
from vessel_hsmc_ros.scenario.run_folder import RunFolder, origin_of, write_summary

if TYPE_CHECKING:
    from vessel_hsmc_ros.report import Record


@dataclass
class FleetResult:
    """The result of a run of a fleet.

    Attributes:
        exit_code: 0; 1 if a node failed; 128 plus the number of the signal that interrupted the run.
        failure: What failed, in one line; empty if nothing did.
        records: The recorded run of each vessel, named by its namespace; none if the run failed.
    """

    folder: RunFolder
    exit_code: int = 0
    failure: str = ""
    records: list["Record"] = field(default_factory=list)


@contextmanager
def reserve_namespaces(fleet: Fleet) -> Iterator[None]:
    """A context in which no other run on this machine uses a namespace of the fleet; in lockstep, nor its /clock.

    Raises:
        RunError: ROS is not installed, or another run uses them.
    """
    with ExitStack() as held:
        for number, namespace in enumerate(fleet.vessels):
            held.enter_context(reserve_namespace(namespace, fleet.lockstep and number == 0))
        yield


def run_fleet(fleet: Fleet, folder: RunFolder, progress: Progress, with_page: bool = True) -> FleetResult:
    """Run a fleet by the real nodes over ROS 2 and record it into one bag.

    Returns:
        The result; a failed run is a result with a nonzero exit code.

    Raises:
        RunError: ROS is not installed.
    """
    supervisor_module()
    from vessel_hsmc_ros.runs.fleet_supervision import spread, supervise_fleet

    origin = origin_of(fleet.base, "lockstep" if fleet.lockstep else "real time", "")
    folder.write_text_of_parameters(dump_fleet(fleet.with_bag(folder.bag.absolute(), folder.parameters.absolute())))
    vessels = tuple(fleet.vessels)
    processes = spread(vessels, fleet.base.vessel_sim.by_thrusters, fleet.lockstep)
    status = supervise_fleet(folder, vessels, progress, processes)
    result = FleetResult(folder, status.code, status.failure)
    try:
        _summarise(result, origin)
        if not result.failure:
            _evaluate(result, origin, with_page)
    except (BagError, ReportError, RunError) as error:
        result.exit_code, result.failure = result.exit_code or 1, result.failure or str(error)
        with suppress(RunError):
            _summarise(result, origin)
    return result


def _evaluate(result: FleetResult, origin: Mapping[str, Any], with_page: bool) -> None:
    """Evaluate the bag, and write the summary, and page and figures if they are wanted."""
    from vessel_hsmc_ros import report  # takes longer to import than the nodes take to start
    from vessel_hsmc_ros.bags.reader import open_bag

    shown = {name: origin[name] for name in report.ORIGIN if origin[name] not in (None, "")}
    result.records = report.of_fleet(open_bag(result.folder.bag), shown)
    _summarise(result, origin)
    if with_page:
        write_page(result.folder, result.records, f"{origin['scenario']}, {len(result.records)} vessels")


def _summarise(result: FleetResult, origin: Mapping[str, Any]) -> None:
    """Write run.json: the metrics and facts of each vessel below `vessels`."""
    vessels = {
        record.name: {"metrics": record.metrics._asdict() if record.metrics else None, **record.facts}
        for record in result.records
    }
    write_summary(result.folder, origin, result.exit_code, result.failure, {"metrics": None, "vessels": vessels})
