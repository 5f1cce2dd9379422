"""A run from its scenario to its folder: by the nodes or offline, measured, drawn, written down."""

import datetime
import os
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from vessel_hsmc_ros import closed_loop
from vessel_hsmc_ros.exceptions import BagError, RunError
from vessel_hsmc_ros.metrics import Metrics, evaluate
from vessel_hsmc_ros.run_data import Run
from vessel_hsmc_ros.run_folder import RunFolder, make_run_folder, provenance
from vessel_hsmc_ros.scenario import Scenario, load_scenario

Progress = Callable[[float], None]

ORIGIN = ("scenario", "mode", "namespace", "seed", "started", "version", "git_commit", "host", "system", "python")
"""What a page tells of where its run comes from, by the names in run.json."""


@dataclass
class Result:
    """What a run came to.

    Attributes:
        folder: Where everything is.
        exit_code: 0, 1 when a node failed, 128 plus the signal's number when it was interrupted.
        failure: What went wrong, in one line; empty when nothing did.
        run: The arrays; None when there is too little to make any.
        facts: Everything else that was measured, by name.
    """

    folder: RunFolder
    exit_code: int = 0
    failure: str = ""
    run: Run | None = None
    metrics: Metrics | None = None
    facts: dict[str, Any] = field(default_factory=dict)


def place_for_nodes(namespace: str) -> AbstractContextManager[None]:
    """A context in which no other run of this machine's uses the ROS domain and namespace.

    Raises:
        RunError: ROS is not installed, or another run is in the way.
    """
    context: AbstractContextManager[None] = _node_run().exclusive(namespace)
    return context


def run_nodes(scenario: Scenario, folder: RunFolder, namespace: str, progress: Progress) -> Result:
    """Run a scenario by the real nodes over ROS 2 and record it.

    A run that fails or is interrupted ends at once: its bag is complete, but nothing is drawn.

    Args:
        scenario: Resolved; its recorder's directory is replaced by one in the run's folder.
        folder: The run's folder.
        namespace: The nodes' namespace, without slashes at its ends.
        progress: Called with the simulated time, s.

    Raises:
        RunError: ROS is not installed.
    """
    node_run = _node_run()
    origin = _origin(scenario, "lockstep" if scenario.controller.lockstep else "real time", namespace)
    folder.write_parameters(scenario.with_bag(folder.bag.absolute()))
    outcome = node_run.run_nodes(folder, namespace, progress)
    result = Result(folder, outcome.exit_code, outcome.failure)
    if not result.failure:
        try:
            _take_bag(result, scenario, folder.bag)
            _present(result, scenario, origin)
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
    run = closed_loop.simulate(scenario, lambda done, _: progress((done - 1) / samples_per_second))
    wall = time.monotonic() - started
    folder = make_run_folder(parent, f"{scenario.name}_offline")
    folder.write_parameters(scenario)
    result = Result(folder, run=run, facts={"real_time_factor": float(run.time[-1]) / wall})
    _present(result, scenario, origin)
    _write_summary(result, origin)
    return result


def report_bag(directory: Path) -> Result:
    """Table, figures and page of a recorded run, from its bag and the parameters beside it.

    Raises:
        BagError: the bag cannot be read.
        ScenarioError: the parameters are missing or cannot be read.
    """
    folder = RunFolder(directory.absolute().parent)
    result = Result(folder)
    scenario = load_scenario(folder.parameters)
    _take_bag(result, scenario, directory)
    _present(result, scenario, folder.read_summary())
    return result


def _node_run() -> Any:
    """The module that needs ROS."""
    try:
        from vessel_hsmc_ros import node_run
    except ModuleNotFoundError as error:
        raise RunError(f"{error.name} is not installed: nodes need ROS 2, only `vessel-hsmc simulate` does without") from None
    return node_run


def _take_bag(result: Result, scenario: Scenario, directory: Path) -> None:
    from vessel_hsmc_ros.bag_reading import read_recording

    recording = read_recording(directory, scenario.vessel_sim.vessel.coefficients())
    result.run = recording.run
    result.facts = _facts(recording.status, sum(recording.messages.values()))
    if not scenario.controller.lockstep:
        intervals = np.diff(recording.run.control["time"])
        result.facts["control_interval_deviation_max"] = float(np.max(np.abs(intervals - 1.0 / scenario.controller.rate_hz)))


def _present(result: Result, scenario: Scenario, origin: Mapping[str, Any]) -> None:
    """Measure and draw."""
    from vessel_hsmc_ros import figures, report  # they take longer to load than the nodes take to start

    run = result.run
    if run is None:
        return
    result.metrics = evaluate(run.time, run.state, run.reference, run.wrench)
    name = str(origin.get("scenario", result.folder.path.name))
    told = {label: origin[label] for label in ORIGIN if origin.get(label) not in (None, "")}
    record = report.Record(name, report.of_run(run), result.metrics, result.facts, scenario, told)
    report.write(result.folder.report, [record], name)
    result.folder.figures.mkdir(exist_ok=True)
    figures.draw(run, result.folder.figures)


def _facts(status: dict[str, dict[str, str]], messages: int) -> dict[str, Any]:
    """What the nodes said of themselves in the end."""
    plant, controller, recorder = (status.get(name, {}) for name in ("vessel_sim", "controller", "recorder"))
    first_command_at = float(plant.get("first_command_at", 0.0))
    return {
        "steps": int(plant.get("steps", 0)),
        "loop_time": float(plant.get("wall_time", 0.0)),
        "real_time_factor": float(plant.get("real_time_factor", 0.0)),
        "start_up": first_command_at - _process_start() if first_command_at > _process_start() else None,
        "missed_periods": int(controller.get("missed_periods", 0)),
        "compute_time_max": float(controller.get("compute_time_max", 0.0)),
        "messages_recorded": messages,
        "messages_dropped": int(recorder.get("dropped", 0)),
    }


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
