"""How a run ends: which of several ends counts, what of its bag is saved, and what its summary has."""

import fcntl
import json
import signal
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from bag_making import write_run

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import is_complete
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError, ReportError, RunError, SimulationError
from vessel_hsmc_ros.faults import FaultScript
from vessel_hsmc_ros.nodes.runs import processes
from vessel_hsmc_ros.nodes.runs.processes import NodeGroup, NodeProcess
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import for_nodes, load_scenario
from vessel_hsmc_ros.studies import scenario_run

supervisor: Any = pytest.importorskip("vessel_hsmc_ros.nodes.runs.supervisor", reason="ROS is not installed")

Codes = dict[str, int | None]
"""Exit codes of processes by the names of their nodes; None for one that runs."""

RUNNING: Codes = {"vessel_sim": None, "reference_ship": None, "controller": None, "recorder": None}


def group(folder: Path, codes: Codes) -> NodeGroup:
    """Nodes of which some have ended; the log of each ends with an error."""
    made = NodeGroup(folder / "none.yaml", folder / "logs", "", {})
    for name, code in codes.items():
        log = folder / f"{name}.log"
        log.write_text(f"[INFO] [1.0] [{name}]: started\n[ERROR] [1.0] [{name}]: first\n[FATAL] [2.0] [{name}]: at last\n")
        popen: Any = SimpleNamespace(poll=lambda code=code: code, returncode=code, args=["x"])
        made.processes.append(NodeProcess(name, popen, log))
    return made


@pytest.mark.parametrize(
    ("code", "text"),
    [(-9, "recorder was killed by SIGKILL"), (0, "recorder exited before the end of the run"), (1, "recorder failed: at last")],
)
def test_the_end_of_a_process_is_described_by_signal_or_last_error(tmp_path: Path, code: int, text: str) -> None:
    (process,) = group(tmp_path, {"recorder": code}).processes
    assert process.describe_exit() == text
    process.log.write_text("nothing of the kind")
    assert process.describe_exit() == (f"recorder failed: exit code 1, see {process.log}" if code == 1 else text)


@pytest.mark.parametrize("namespace", ["", "fleet."])
def test_the_failure_of_a_node_that_shares_a_process_has_its_own_name(tmp_path: Path, namespace: str) -> None:
    log, popen = tmp_path / "log", SimpleNamespace(returncode=1)
    log.write_text(f"[FATAL] [1.0] [{namespace}one.controller]: at last\n")
    process = NodeProcess("group_1", popen, log, ("one/vessel_sim", "one/controller"))  # type: ignore[arg-type]
    assert process.describe_exit() == "one/controller failed: at last"
    log.write_text("[FATAL] [1.0] [rcl]: at last\n")
    assert process.describe_exit() == "group_1 failed: at last"


def test_a_process_whose_work_was_done_when_the_middleware_did_not_let_it_go_has_not_failed(tmp_path: Path) -> None:
    nodes = group(tmp_path, {"recorder": -signal.SIGALRM})
    (process,) = nodes.processes
    assert process.describe_exit() == "recorder failed: at last"  # the work failed, then it hung
    assert nodes.failed() is process
    process.log.write_text("[ERROR] [1.0] [recorder]: for a while\nTimeout\n")
    assert (process.code, nodes.failed()) == (0, None)


def test_of_ended_processes_only_errors_count_as_failures_that_are_not_left_out(tmp_path: Path) -> None:
    nodes = group(tmp_path, {"a": None, "b": 0, "c": 3, "d": -9})

    def name(process: NodeProcess | None) -> str:
        return process.name if process else ""

    assert nodes.ended()
    assert not group(tmp_path, {"a": None}).ended()
    assert [name(nodes.failed()), name(nodes.failed(but={"c"})), name(nodes.failed(but={"c", "d"}))] == ["c", "d", ""]


@pytest.mark.parametrize(
    ("names", "namespace", "expected", "within"),
    [
        (["controller"], "", ["controller"], ""),
        (["controller"], "boat", ["controller"], "/boat"),
        (["vessel_2/controller"], "", ["controller"], "/vessel_2"),
        (["vessel_2/controller"], "fleet", ["controller"], "/fleet/vessel_2"),
        (["recorder"], "a/b", ["recorder"], "/a/b"),
        (["recorder", "controller"], "", ["node_group", "recorder", "controller"], ""),
        (["one/vessel_sim", "two/controller"], "a/b", ["node_group", "a/b/one/vessel_sim", "a/b/two/controller"], ""),
    ],
)
def test_a_node_runs_in_the_namespace_of_the_run_and_of_its_vessel(
    names: list[str], namespace: str, expected: list[str], within: str
) -> None:
    command = processes.node_command(names, Path("p.yaml"), namespace)
    assert command[1 : command.index("--ros-args")] == ["-m", "vessel_hsmc_ros.nodes", *expected]
    assert command[command.index("--params-file") + 1] == "p.yaml"
    assert [part for part in command if part.startswith("__ns")] == ([f"__ns:={within}"] if within else [])


class Listener:
    """Diagnostics of a run: each time that it listens the next step of a story happens."""

    def __init__(self, *story: Callable[["Listener"], object]) -> None:
        self.status: dict[str, dict[str, str]] = {}
        self.heard_at: dict[str, float] = {}
        self._story = iter(story)

    def listen(self, _limit: float) -> None:
        step = next(self._story, None)
        if step is not None:
            step(self)


def simulated(seconds: float) -> Callable[[Listener], object]:
    def step(listener: Listener) -> None:
        listener.status["vessel_sim"] = {"simulated_time": str(seconds)}
        listener.heard_at |= dict.fromkeys(RUNNING, time.monotonic())

    return step


class Watched:
    """A run under supervision."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder, self.codes, self.relay = folder, dict(RUNNING), group(folder, {})
        self.interrupts, self.affected, self.progress = supervisor.Interrupts(), set[str](), list[float]()
        monkeypatch.setattr(supervisor, "SILENCE_LIMIT", 0.2)

    def end(self, name: str, code: int) -> Callable[[Listener], object]:
        """A step of a story in which a node ends."""

        def step(_: Listener) -> None:
            self.codes[name] = code
            self.nodes.processes[:] = group(self.folder, self.codes).processes

        return step

    def watch(self, *story: Callable[[Listener], object]) -> Any:
        self.nodes = group(self.folder, self.codes)
        faults: Any = SimpleNamespace(affected=self.affected)
        watched = supervisor.Watched(supervisor.spread((), False, True), self.nodes, self.relay, Listener(*story), faults)
        return supervisor._monitor(watched, self.interrupts, self.progress.append)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Watched:
    return Watched(tmp_path, monkeypatch)


def test_a_run_ends_well_when_its_plant_does_and_its_progress_is_the_simulated_time(run: Watched) -> None:
    status = run.watch(lambda _: None, simulated(0.5), simulated(2.0), run.end("vessel_sim", 0))
    assert (status.code, status.failure) == (0, "")
    assert run.progress == [0.5, 2.0]


@pytest.mark.parametrize(
    ("name", "code", "failure"),
    [
        ("vessel_sim", 1, "vessel_sim failed: at last"),
        ("vessel_sim", -11, "vessel_sim was killed by SIGSEGV"),
        ("controller", 0, "controller exited before the end of the run"),
        ("recorder", 1, "recorder failed: at last"),
    ],
)
def test_any_other_end_of_a_node_is_a_failure(run: Watched, name: str, code: int, failure: str) -> None:
    status = run.watch(run.end(name, code))
    assert (status.code, status.failure) == (1, failure)


def test_the_end_of_the_relay_is_a_failure(run: Watched) -> None:
    run.relay = group(run.folder, {"fault_relay": 0})
    assert run.watch().failure == "fault_relay exited before the end of the run"


def test_a_node_that_a_fault_killed_does_not_end_the_run(run: Watched) -> None:
    run.affected = {"controller"}
    assert run.watch(run.end("controller", -9), simulated(1.0), run.end("vessel_sim", 0)).code == 0
    assert run.progress == [1.0]


def test_an_interrupt_counts_before_the_end_that_it_causes_and_the_first_of_two(run: Watched) -> None:
    def interrupt(_: Listener) -> None:
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.raise_signal(number)
        run.end("vessel_sim", 0)(_)

    with run.interrupts:
        status = run.watch(interrupt)
    assert (status.code, status.failure) == (128 + signal.SIGTERM, "interrupted by SIGTERM")


def test_a_node_that_falls_silent_is_named_unless_a_fault_stopped_it(run: Watched) -> None:
    def late(listener: Listener) -> None:
        simulated(1.0)(listener)
        listener.heard_at |= {"controller": time.monotonic() - 5.0, "watchdog": 0.0}

    assert run.watch(late).failure.startswith("the run has stalled; controller has been silent for 5.")
    run.affected = {"controller"}
    assert run.watch(late, run.end("vessel_sim", 0)).code == 0


def test_nodes_that_do_not_find_each_other_end_the_run_and_those_that_did_have_all_time(
    run: Watched, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervisor, "CONNECT_LIMIT", 0.0)
    assert run.watch(lambda _: time.sleep(0.001)).failure.startswith("the nodes did not discover each other within 0 s")
    assert run.watch(simulated(0.1), lambda _: time.sleep(0.001), run.end("vessel_sim", 0)).code == 0


# -- the bag ----------------------------------------------------------------------------------------------------------

STATUSES = [supervisor.ExitStatus(0), supervisor.ExitStatus(1, "it failed"), supervisor.ExitStatus(130, "interrupted by SIGINT")]


@pytest.mark.parametrize("status", STATUSES, ids=lambda status: str(status.code))
def test_the_bag_of_a_killed_recorder_is_repaired_however_the_run_ended(tmp_path: Path, status: Any) -> None:
    sent = write_run(tmp_path / "bag", 20, close=False)
    assert not is_complete(tmp_path / "bag")
    assert supervisor.after_shutdown(status, None, tmp_path / "bag") == status
    assert is_complete(tmp_path / "bag")
    assert open_bag(tmp_path / "bag")["odom"].count == len(sent["/odom"])


@pytest.mark.parametrize("status", STATUSES, ids=lambda status: str(status.code))
def test_a_node_that_fails_after_the_end_makes_a_failure_of_a_run_that_had_none(tmp_path: Path, status: Any) -> None:
    (failed,) = group(tmp_path, {"recorder": 1}).processes
    found = supervisor.after_shutdown(status, failed, tmp_path / "bag")
    assert found == (status if status.code else supervisor.ExitStatus(1, "recorder failed: at last"))


@pytest.mark.parametrize("status", STATUSES, ids=lambda status: str(status.code))
def test_a_bag_that_cannot_be_repaired_is_the_failure_of_a_run_that_had_none(tmp_path: Path, status: Any) -> None:
    (tmp_path / "bag").mkdir()
    found = supervisor.after_shutdown(status, None, tmp_path / "bag")
    assert found.code == (status.code or 1)
    assert ("holds no MCAP file" in found.failure) == (not status.code)


def test_the_bag_of_a_recorder_that_still_writes_is_left_alone(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    found = supervisor.after_shutdown(STATUSES[0], None, tmp_path / "bag")
    assert (found.code, "is being recorded" in found.failure) == (1, True)
    fcntl.flock(writer._file._file._fd, fcntl.LOCK_UN)
    assert supervisor.after_shutdown(STATUSES[0], None, tmp_path / "bag") == STATUSES[0]


# -- the run folder ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("status", "error", "code", "failure"),
    [
        (STATUSES[0], None, 0, ""),
        (STATUSES[0], BagError("no bag"), 1, "no bag"),
        (STATUSES[0], ReportError("no page"), 1, "no page"),
        (STATUSES[1], None, 1, "it failed"),
        (STATUSES[2], None, 130, "interrupted by SIGINT"),
    ],
)
def test_a_run_of_nodes_has_its_own_end_else_that_of_its_evaluation_and_its_summary_has_it_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: Any, error: Exception | None, code: int, failure: str
) -> None:
    evaluated: list[float] = []

    def evaluate(_result: Any, _origin: Any, requested_at: float, _with_page: bool) -> None:
        evaluated.append(requested_at)
        if error:
            raise error

    given: list[Any] = []

    def supervise(*arguments: Any) -> Any:
        given.append(arguments)
        return status

    module = SimpleNamespace(supervise=supervise)
    monkeypatch.setattr(scenario_run, "supervisor_module", lambda: module)
    monkeypatch.setattr(scenario_run, "_evaluate_bag", evaluate)
    scenario, folder, progress = load_scenario("case2_straight", {"vessel_sim.duration": 1.0}), RunFolder(tmp_path), list[float]()
    found = scenario_run.run_nodes(scenario, folder, "boat", progress.append, 9000, 7.5, composed=True)
    assert (found.exit_code, found.failure) == (code, failure)
    assert evaluated == ([] if status.failure else [7.5])
    assert given == [(folder, scenario, "boat", progress.append, 9000, None, (), True)]
    summary = json.loads(folder.summary.read_text())
    assert (summary["exit_code"], summary["failure"], summary["namespace"]) == (code, failure, "boat")
    written = folder.parameters.read_text()
    assert str(folder.bag.absolute()) in written
    assert "duration: 1.0" in written


@pytest.mark.parametrize(
    ("real_time", "faults", "wanted", "shared"),
    [(False, None, True, True), (False, None, False, False), (True, None, True, False), (False, FaultScript(), True, False)],
)
def test_nodes_share_a_process_only_in_lockstep_and_without_faults(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, real_time: bool, faults: Any, wanted: bool, shared: bool
) -> None:
    given: list[Any] = []

    def supervise(*arguments: Any) -> Any:
        given.append(arguments[-1])
        return STATUSES[2]

    module = SimpleNamespace(Injection=supervisor.Injection, supervise=supervise)
    monkeypatch.setattr(scenario_run, "supervisor_module", lambda: module)
    scenario = load_scenario("case2_straight", for_nodes(True, real_time, ""))
    scenario_run.run_nodes(scenario, RunFolder(tmp_path), "", lambda _: None, faults=faults, composed=wanted)
    assert given == [shared]


def test_a_disk_that_is_full_hides_no_interrupt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise RunError("the disk is full")

    monkeypatch.setattr(scenario_run, "supervisor_module", lambda: SimpleNamespace(supervise=lambda *_: STATUSES[2]))
    monkeypatch.setattr(scenario_run, "write_results", full)
    found = scenario_run.run_nodes(load_scenario("case2_straight"), RunFolder(tmp_path), "", lambda _: None)
    assert (found.exit_code, found.failure) == (130, "interrupted by SIGINT")


DIVERGED, INTERRUPT, FULL = SimulationError("the motion is no longer finite"), KeyboardInterrupt(), RunError("the disk is full")
OWN: dict[BaseException | None, tuple[int, str]] = {
    None: (0, ""),
    DIVERGED: (1, str(DIVERGED)),
    INTERRUPT: (130, "interrupted by SIGINT"),
}
"""Exit code and failure of a run by how it ends itself."""


@pytest.mark.parametrize("own", OWN, ids=repr)
@pytest.mark.parametrize("place", ["", "bag", "summary", "page"])
def test_a_run_offline_has_its_own_end_else_that_of_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, own: BaseException | None, place: str
) -> None:
    """Where a file cannot be written, all others are."""

    def end(*_: object) -> None:
        if own:
            raise own

    def refuse(error: Exception) -> Any:
        def refused(*_: object) -> Any:
            raise error

        return refused

    monkeypatch.setenv("VESSEL_HSMC_INTERPRETED", "1")
    monkeypatch.setattr("vessel_hsmc_ros.simulation.offline.ClosedLoop.run", end)
    monkeypatch.setattr(scenario_run, "_evaluate_run", refuse(ReportError("no page")) if place == "page" else lambda *_: None)
    monkeypatch.setattr(
        "vessel_hsmc_ros.bags.run_to_bag.write_bag", refuse(BagError("no bag")) if place == "bag" else lambda *_: 7
    )
    if place == "summary":
        monkeypatch.setattr(scenario_run, "write_summary", refuse(FULL))
    scenario = load_scenario("case2_straight", {"vessel_sim.duration": 2.0})
    found = scenario_run.run_offline(scenario, tmp_path, lambda _: None)
    code, failure = OWN[own]
    if place and not (place == "page" and own):  # a run that failed has no page
        code, failure = code or 1, failure or {"bag": "no bag", "summary": str(FULL), "page": "no page"}[place]
    assert (found.exit_code, found.failure) == (code, failure)
    if place != "summary":
        summary = json.loads(found.folder.summary.read_text())
        assert (summary["exit_code"], summary["failure"]) == (code, failure)
        assert summary.get("messages_recorded") == (None if place == "bag" else 7)
