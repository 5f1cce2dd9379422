"""Runs a scenario by the nodes or offline, or a fleet by the nodes, and writes its run folder: page, figures, summary."""

import datetime
import importlib.util
import os
import signal
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vessel_hsmc_ros.core.exceptions import BagError, ControlError, ReportError, RunError, SimulationError
from vessel_hsmc_ros.core.install_paths import missing_module
from vessel_hsmc_ros.core.metrics import Metrics, Run, position_error
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.faults import FaultScript
from vessel_hsmc_ros.nodes.ros_environment import check_messages, check_ros
from vessel_hsmc_ros.scenario.law_file import law_provenance
from vessel_hsmc_ros.scenario.run_folder import RunFolder, make_run_folder, provenance, write_summary
from vessel_hsmc_ros.scenario.scenario import Fleet, Scenario, dump_fleet, dump_scenario, for_nodes, load_scenario
from vessel_hsmc_ros.studies.batch import run_all

if TYPE_CHECKING:
    from vessel_hsmc_ros.report.record import Record
    from vessel_hsmc_ros.simulation import offline


Progress = Callable[[float], None]

DOMAIN, LAST_DOMAIN = "ROS_DOMAIN_ID", 101
"""Environment variable of the ROS domain, and the last domain whose ports Linux does not give to other programs."""


@dataclass
class Result:
    """The result of a run."""

    folder: RunFolder
    exit_code: int = 0  # 0; 1 if a node failed; 128 plus the number of the signal that interrupted the run
    failure: str = ""  # what failed, in one line; empty if nothing did
    metrics: Metrics | None = None  # metrics of the run; None if it is too short for them
    facts: dict[str, Any] = field(default_factory=dict)  # all other measured values, by their keys in run.json
    # of a fleet, the recorded run of each vessel, named by its namespace; none if the run failed
    records: list["Record"] = field(default_factory=list)


def reserve_namespace(namespace: str, lockstep: bool = True) -> AbstractContextManager[None]:
    """A context in which no other run on this machine uses the ROS domain and namespace; in lockstep, nor its /clock."""
    context: AbstractContextManager[None] = supervisor_module().exclusive(namespace, lockstep)
    return context


@contextmanager
def free_domains(count: int) -> Iterator[list[str]]:
    """A context with ROS domains where no other run on this machine takes place: that of ROS_DOMAIN_ID, or 0 and high ones."""
    module, given = supervisor_module(), os.environ.get(DOMAIN)
    # After the default the highest ones: people and test tools count upwards, and nodes that are started by hand reserve none.
    candidates = [given] if given else ["0", *(str(domain) for domain in range(LAST_DOMAIN, 0, -1))]
    found: list[str] = []
    with ExitStack() as reserved:
        for domain in candidates:
            try:
                reserved.enter_context(module.exclusive("", lockstep=True, domain=domain))
            except RunError:
                if domain == candidates[-1] and not found:
                    raise
            else:
                found.append(domain)
            if len(found) == count:
                break
        yield found


def origin_of(scenario: Scenario, mode: str, namespace: str) -> dict[str, Any]:
    """Provenance of a run, the first lines of its summary: code, machine, scenario, mode, time."""
    return {
        **provenance(),
        "scenario": scenario.name,
        "mode": mode,
        "namespace": namespace,
        "seed": scenario.vessel_sim.seed,
        **law_provenance(scenario.controller.law),
        "started": datetime.datetime.now(tz=datetime.timezone.utc).isoformat(),
    }


def run_nodes(
    scenario: Scenario,
    folder: RunFolder,
    namespace: str,
    progress: Progress,
    live_port: int | None = None,
    requested_at: float | None = None,
    faults: FaultScript | None = None,
    with_page: bool = True,
    composed: bool = True,
) -> Result:
    """Run a scenario by the real nodes over ROS 2 and record it.

    A run that fails or is interrupted ends at once: its bag is complete, but no page and no figures are made. `live_port`: port
    of the live view; None for no live view. Returns the result; a failed run is a result with a nonzero exit code.
    """
    supervisor = supervisor_module()
    origin = origin_of(scenario, "lockstep" if scenario.controller.lockstep else "real time", namespace)
    injection = None if faults is None else supervisor.Injection(faults, scenario)
    if faults:
        origin |= {"faults": [fault.describe() for fault in faults.faults]}
    recorded = scenario.with_bag(folder.bag.absolute(), folder.parameters.absolute())
    folder.write_parameters(dump_scenario(recorded if injection is None else injection.relayed(recorded)))
    composed = composed and may_share(scenario, faults)
    status = supervisor.supervise(folder, scenario, namespace, progress, live_port, injection, (), composed)
    result = Result(folder, status.code, status.failure)
    summarise(result, origin, lambda: _evaluate_bag(result, origin, requested_at or _process_start(), with_page))
    return result


def may_share(scenario: Scenario, faults: FaultScript | None) -> bool:
    """Whether the nodes of a run may share a process: in real time one would delay another, and faults act on processes."""
    return scenario.controller.lockstep and faults is None


def run_offline(scenario: Scenario, parent: Path, progress: Progress, with_bag: bool = True, with_page: bool = True) -> Result:
    """Run a scenario in this process, without ROS, and write a run folder with its bag.

    A run that fails or is interrupted is recorded up to there, but no page and no figures are made. Returns the result; a
    failed run is a result with a nonzero exit code.
    """
    from vessel_hsmc_ros.simulation import offline  # a run of the nodes starts without it

    origin = origin_of(scenario, "offline", "")
    loop = offline.ClosedLoop(scenario)
    result = Result(make_run_folder(parent, f"{scenario.name}_offline"))  # before the run: a folder is refused at once
    result.folder.write_parameters(dump_scenario(scenario))
    _run_loop(loop, result, lambda done, _: progress((done - 1) / scenario.vessel_sim.rate_hz))
    if with_bag:
        _write_bag(loop, result, scenario)
    summarise(result, origin, lambda: _evaluate_run(result, scenario, loop.result(), origin, with_page))
    return result


def summarise(result: Result, origin: Mapping[str, Any], evaluate: Callable[[], None]) -> None:
    """Write the summary of a run, and evaluate it if it has not failed; what cannot be read or written is its failure."""
    try:
        write_results(result, origin)  # first of all: what follows takes seconds and may be interrupted
        if not result.failure:
            evaluate()
    except (BagError, ReportError, RunError) as error:
        _note_failure(result, error)
        with suppress(RunError):
            write_results(result, origin)


def _note_failure(result: Result, error: Exception) -> None:
    """Note why the files of a run cannot be written; a full disk must not hide why the run failed or was interrupted."""
    result.exit_code, result.failure = result.exit_code or 1, result.failure or str(error)


def _run_loop(loop: "offline.ClosedLoop", result: Result, progress: "offline.Progress") -> None:
    """Run a closed loop to its end, to its failure or to an interrupt."""
    started = time.monotonic()
    try:
        loop.run(progress)
    except (SimulationError, ControlError) as error:
        result.exit_code, result.failure = 1, str(error)
    except KeyboardInterrupt:
        result.exit_code, result.failure = 128 + signal.SIGINT, f"interrupted by {signal.SIGINT.name}"
    result.facts = {"steps": loop.done, "real_time_factor": loop.time / (time.monotonic() - started)}


def _write_bag(loop: "offline.ClosedLoop", result: Result, scenario: Scenario) -> None:
    """Write the bag of a closed loop as far as it has come."""
    from vessel_hsmc_ros.bags.run_to_bag import write_bag  # imports the libraries of bags

    try:
        result.facts["messages_recorded"] = write_bag(result.folder.bag, loop.published(), scenario)
    except BagError as error:
        _note_failure(result, error)


def check_live_port(port: int) -> None:
    """Check that a live view can be served. Raises RunError if its library is missing, or the port is in use."""
    if importlib.util.find_spec("foxglove") is None:
        raise RunError("the live view needs foxglove-sdk, which is not installed: pip install foxglove-sdk")
    try:
        with socket.create_server(("127.0.0.1", port)):
            pass
    except OSError as error:
        raise RunError(f"the live view cannot listen on port {port}: {error.strerror}") from None


def supervisor_module() -> Any:
    """Import the module that needs ROS."""
    check_ros()
    try:
        from vessel_hsmc_ros.nodes.runs import supervisor

        check_messages()  # the nodes need them; here their absence is one line instead of a log file
    except ModuleNotFoundError as error:
        raise RunError(missing_module(error)) from None
    return supervisor


def _evaluate_bag(result: Result, origin: Mapping[str, Any], requested_at: float, with_page: bool) -> None:
    """Evaluate the bag of the nodes, and write page and figures if they are wanted."""
    from vessel_hsmc_ros import report  # takes longer to import than the nodes take to start

    record = report.of_bag(result.folder.bag, origin["namespace"])
    start_up = record.facts.get("first_command_at", 0.0) - requested_at
    result.facts = {**record.facts, "start_up": start_up if start_up > 0.0 else None}
    _write_report(result, record, origin, with_page)


def _evaluate_run(result: Result, scenario: Scenario, run: Run, origin: Mapping[str, Any], with_page: bool) -> None:
    """Evaluate a run that was computed in this process, and write page and figures if they are wanted."""
    from vessel_hsmc_ros import report

    _write_report(result, report.analyse(scenario.name, run, scenario), origin, with_page)


def _write_report(result: Result, record: "Record", origin: Mapping[str, Any], with_page: bool) -> None:
    """Write the summary of a run, and its page and figures if they are wanted."""
    from vessel_hsmc_ros import report

    shown = {name: origin[name] for name in report.ORIGIN if origin[name] not in (None, "")}
    record = replace(record, facts=result.facts, provenance={**shown, **record.provenance})
    result.metrics = record.metrics
    write_results(result, origin)  # before the page: it is the result if the page is interrupted or the disk is full
    if with_page:
        write_page(result.folder, [record], record.name)


def write_page(folder: RunFolder, records: Sequence["Record"], title: str) -> None:
    """Write page and figures of the runs of a folder. Raises ReportError if they cannot be written."""
    from vessel_hsmc_ros import report
    from vessel_hsmc_ros.report import figures  # draws with a library that takes long to import

    report.write(folder.report, records, title)
    figures.draw(records, folder.figures)


def write_results(result: Result, origin: Mapping[str, Any]) -> None:
    """Write run.json with what is known of a run so far."""
    metrics = result.metrics._asdict() if result.metrics else None
    write_summary(result.folder, origin, result.exit_code, result.failure, {"metrics": metrics, **result.facts})


def _process_start() -> float:
    """Start of this process on the clock of time.time(), before the interpreter ran its first line, s."""
    # Field 22 of stat, in clock ticks since boot; the command name before it may contain spaces, but ends with ")".
    after_boot = float(Path("/proc/self/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[19])
    return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME) + after_boot / os.sysconf("SC_CLK_TCK")


@contextmanager
def reserve_namespaces(fleet: Fleet) -> Iterator[None]:
    """A context in which no other run on this machine uses a namespace of the fleet; in lockstep, nor its /clock."""
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
    folder.write_parameters(dump_fleet(fleet.with_bag(folder.bag.absolute(), folder.parameters.absolute())))
    status = supervisor.supervise(folder, fleet.base, "", progress, vessels=tuple(fleet.vessels))
    result = Result(folder, status.code, status.failure, facts={"vessels": {}})
    summarise(result, origin, lambda: _evaluate_fleet(result, origin, with_page))
    return result


def _evaluate_fleet(result: Result, origin: Mapping[str, Any], with_page: bool) -> None:
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


SCENARIO = "case2_tracking"
LAWS = ("hierarchical", "hierarchical_printed", "guided")
"""In the order of their colours in comparisons (`diagrams.LAW_COLOURS`), so that a law has one colour in every figure."""

DURATION = 100.0  # simulated time, s: long enough to show which law converges, and short enough to wait for
CONVERGED = 0.5  # a law with a smaller rms position error over the last quarter of the run counts as converged, m
UNEQUAL_FORCES = 10.0  # ratio of the largest surge forces of two runs above which their approaches cannot be compared
TITLES = {
    "hierarchical": "The paper's law, repaired (hierarchical)",
    "hierarchical_printed": "The paper's law as printed (hierarchical_printed)",
    "guided": "The guided law",
}
CAUSES = {
    "hierarchical_printed": "the sway and heading terms of its surface S1 cancel each other without vanishing (equation 46)"
}
"""Why a law fails to converge, where the analysis in docs/paper.md explains it."""


class Task(NamedTuple):
    """A run of the demonstration: its law, its folder, its ROS domain and its simulated time, s."""

    law: str
    folder: RunFolder
    domain: str
    duration: float


def run_laws(output: Path, progress: Progress, on_result: Callable[[Result], None]) -> RunFolder:
    """Run the scenario under each law by the nodes: at the same time in ROS domains of their own, if there are cores for it."""
    with free_domains(len(LAWS)) as domains:
        parent = make_run_folder(output, "demo")
        folders = [RunFolder(parent.path / law) for law in LAWS]
        tasks = [Task(*each, DURATION) for each in zip(LAWS, folders, cycle(domains), strict=False)]
        # Runs that share a domain take place one after the other; otherwise there is one for each core.
        workers = None if len(domains) == len(LAWS) else 1
        run_all(_run, tasks, workers=workers, on_result=on_result, on_progress=progress)
    return parent


def _run(task: Task, progress: Progress) -> Result:
    """Run the scenario under a law into its folder."""
    requested_at = time.time()
    os.environ[DOMAIN] = task.domain
    settings = {"controller.law": task.law, "vessel_sim.duration": task.duration}
    scenario = load_scenario(SCENARIO, {**for_nodes(recorded=True, real_time=False), **settings})
    task.folder.path.mkdir()
    return run_nodes(scenario, task.folder, "", progress, requested_at=requested_at)


def conclusions(records: Sequence["Record"]) -> tuple[str, ...]:
    """One sentence on each run, whether its law converges, and one on the forces by which their approaches differ."""
    judged = [(record, record.metrics) for record in records if record.metrics]
    return (*(_conclusion(record, metrics) for record, metrics in judged), *_forces(judged))


def _forces(judged: Sequence[tuple["Record", Metrics]]) -> Iterator[str]:
    """A sentence where the surge forces differ so much that the errors of the approaches cannot be compared."""
    if len(judged) < 2:
        return
    ordered = sorted(judged, key=lambda pair: pair[1].surge_force_peak)
    (weak, least), (strong, most) = ordered[0], ordered[-1]
    if most.surge_force_peak > UNEQUAL_FORCES * least.surge_force_peak:
        yield (
            f"Compare the last quarter only: on the way {_title(strong, first=False)} used"
            f" up to {quantity(most.surge_force_peak, 'N')} of surge force, and {_title(weak, first=False)} up to"
            f" {quantity(least.surge_force_peak, 'N')}."
        )


def _title(record: "Record", first: bool = True) -> str:
    """The name of a run's law in a sentence, at its beginning or within it."""
    title = TITLES.get(record.name, record.name)
    return title if first else title[0].lower() + title[1:]


def _conclusion(record: "Record", metrics: Metrics) -> str:
    run = record.run
    law = _title(record)
    late = f"{metrics.position_error_rms_last_quarter:.2g} m rms over the last quarter of {record.duration:g} s"
    initial = float(position_error(run.state[:1], run.reference[:1])[0])
    if metrics.position_error_rms_last_quarter < CONVERGED:
        return f"{law} converges to the reference: the position error falls from {initial:.3g} m to {late}."
    heading = f"while the heading error is {abs(metrics.heading_error_final_deg):.1g}° at the end"
    cause = f": {CAUSES[record.name]}" if record.name in CAUSES else ""
    return f"{law} does not converge: the position error is {late}, {heading}{cause}."
