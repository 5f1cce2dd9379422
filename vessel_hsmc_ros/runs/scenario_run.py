"""A run from its scenario to its folder: by the nodes or offline, measured, drawn, written down."""

import datetime
import importlib.util
import os
import socket
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vessel_hsmc_ros.core.exceptions import BagError, RunError
from vessel_hsmc_ros.core.install_paths import missing_module
from vessel_hsmc_ros.core.metrics import Metrics, evaluate
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.runs import offline
from vessel_hsmc_ros.scenario.run_folder import RunFolder, make_run_folder, provenance
from vessel_hsmc_ros.scenario.scenario import Scenario

if TYPE_CHECKING:
    from vessel_hsmc_ros.report import Record

Progress = Callable[[float], None]


@dataclass
class Result:
    """What a run came to.

    Attributes:
        folder: Where everything is.
        exit_code: 0, 1 when a node failed, 128 plus the signal's number when it was interrupted.
        failure: What went wrong, in one line; empty when nothing did.
        metrics: None when there is too little to measure.
        facts: Everything else that was measured, by name.
    """

    folder: RunFolder
    exit_code: int = 0
    failure: str = ""
    metrics: Metrics | None = None
    facts: dict[str, Any] = field(default_factory=dict)


def place_for_nodes(namespace: str) -> AbstractContextManager[None]:
    """A context in which no other run of this machine's uses the ROS domain and namespace.

    Raises:
        RunError: ROS is not installed, or another run is in the way.
    """
    context: AbstractContextManager[None] = _supervisor().exclusive(namespace)
    return context


def run_nodes(scenario: Scenario, folder: RunFolder, namespace: str, progress: Progress, live_port: int | None = None) -> Result:
    """Run a scenario by the real nodes over ROS 2 and record it.

    A run that fails or is interrupted ends at once: its bag is complete, but nothing is drawn.

    Args:
        scenario: Resolved; its recorder's directory is replaced by one in the run's folder.
        folder: The run's folder.
        namespace: The nodes' namespace, without slashes at its ends.
        progress: Called with the simulated time, s.
        live_port: Where to let others watch; None for nowhere.

    Raises:
        RunError: ROS is not installed.
    """
    supervisor = _supervisor()
    origin = _origin(scenario, "lockstep" if scenario.controller.lockstep else "real time", namespace)
    folder.write_parameters(scenario.with_bag(folder.bag.absolute(), folder.parameters.absolute()))
    outcome = supervisor.run_nodes(folder, namespace, progress, live_port)
    result = Result(folder, outcome.exit_code, outcome.failure)
    if not result.failure:
        try:
            _take_bag(result, origin)
        except BagError as error:
            result.exit_code, result.failure = 1, str(error)
    _write_summary(result, origin)
    return result


def run_offline(scenario: Scenario, parent: Path, progress: Progress) -> Result:
    """Run a scenario in this process, without ROS; what came of it goes into a new run folder below `parent`.

    Raises:
        ScenarioError: the scenario has no end.
        SimulationError, ControlError: the loop cannot go on.
        RunError: the run's folder cannot be made.
    """
    origin = _origin(scenario, "offline", "")
    started = time.monotonic()
    samples_per_second = scenario.vessel_sim.rate_hz
    run = offline.simulate(scenario, lambda done, _: progress((done - 1) / samples_per_second))
    wall = time.monotonic() - started
    folder = make_run_folder(parent, f"{scenario.name}_offline")
    folder.write_parameters(scenario)
    result = Result(folder, facts={"real_time_factor": float(run.time[-1]) / wall})
    _take_run(result, scenario, run, origin)
    _write_summary(result, origin)
    return result


def check_live_port(port: int) -> None:
    """See that a live view can be served.

    Raises:
        RunError: its library is missing, or the port is taken.
    """
    if importlib.util.find_spec("foxglove") is None:
        raise RunError("the live view needs foxglove-sdk, which is not installed: pip install foxglove-sdk")
    try:
        with socket.create_server(("127.0.0.1", port)):
            pass
    except OSError as error:
        raise RunError(f"the live view cannot listen on port {port}: {error.strerror}") from None


def _supervisor() -> Any:
    """The module that needs ROS."""
    try:
        from vessel_hsmc_ros.runs import supervisor
    except ModuleNotFoundError as error:
        raise RunError(missing_module(error)) from None
    return supervisor


def _take_bag(result: Result, origin: Mapping[str, Any]) -> None:
    """What the nodes recorded."""
    from vessel_hsmc_ros import report  # takes longer to load than the nodes take to start

    record = report.of_bag(result.folder.bag, origin["namespace"])
    result.facts = {**record.facts, "start_up": _start_up(record.facts.get("first_command_at", 0.0))}
    _present(result, record, origin)


def _take_run(result: Result, scenario: Scenario, run: Run, origin: Mapping[str, Any]) -> None:
    """What was computed in this process."""
    from vessel_hsmc_ros import report

    metrics = evaluate(run.time, run.state, run.reference, run.wrench)
    _present(result, report.Record(scenario.name, run, metrics, scenario=scenario), origin)


def _present(result: Result, record: "Record", origin: Mapping[str, Any]) -> None:
    """The page and the figures of a run."""
    from vessel_hsmc_ros import report
    from vessel_hsmc_ros.report import figures

    told = {name: origin[name] for name in report.ORIGIN if origin[name] not in (None, "")}
    record = replace(record, facts=result.facts, provenance={**told, **record.provenance})
    result.metrics = record.metrics
    report.write(result.folder.report, [record], record.name)
    figures.draw([record], result.folder.figures)


def _start_up(first_command_at: float) -> float | None:
    """Time from the command to the first control step, s; None where there was none."""
    started = _process_start()
    return first_command_at - started if first_command_at > started else None


def _origin(scenario: Scenario, mode: str, namespace: str) -> dict[str, Any]:
    """Which code on which machine runs what, and when: the summary's first lines."""
    return {
        **provenance(),
        "scenario": scenario.name,
        "mode": mode,
        "namespace": namespace,
        "seed": scenario.vessel_sim.seed,
        "started": _now().isoformat(),
    }


def _write_summary(result: Result, origin: Mapping[str, Any]) -> None:
    began = datetime.datetime.fromisoformat(origin["started"])
    summary = {
        **origin,
        "duration": (_now() - began).total_seconds(),
        "exit_code": result.exit_code,
        "failure": result.failure,
        "metrics": result.metrics._asdict() if result.metrics else None,
        **result.facts,
    }
    result.folder.write_summary(summary)


def _now() -> datetime.datetime:
    return datetime.datetime.now(tz=datetime.timezone.utc)


def _process_start() -> float:
    """When this process was started, in the seconds of time.time(); from before the interpreter's first line."""
    after_boot = float(Path("/proc/self/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[19])
    return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME) + after_boot / os.sysconf("SC_CLK_TCK")
