"""Every option of a verb arrives at the function that does its work: options of unlike values, and the call that they lead to."""

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest
from click.testing import CliRunner
from reaching import Reach

from vessel_hsmc_ros.cli import boat
from vessel_hsmc_ros.cli.command import VERBS, cli
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.scenario.own_ship import MainData
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.scenario_run import Result as RunResult

DURATION = "vessel_sim.duration"


def test_compare_runs_every_law_on_every_scenario_at_the_rate_on_so_many_workers(reach: Reach) -> None:
    settings = "--set", f"{DURATION}=2.5", "--set", "vessel_sim.seed=7"
    options = "--laws", "los_pid, guided", "--rate-hz", 20, "--workers", 3, *settings
    found = reach("vessel_hsmc_ros.studies.comparison.compare", "compare", "case2_straight", "case2_tracking", *options)
    tasks = [(task.row.name, task.row.scenario, task.law, task.rate_hz) for task in found["tasks"]]
    scenarios = ("case2_straight", "case2_tracking")
    assert tasks == [(name, name, law, 20.0) for name in scenarios for law in ("los_pid", "guided")]
    assert all(task.row.changes == {DURATION: 2.5, "vessel_sim.seed": 7} for task in found["tasks"])
    assert found["jobs"] == 3


@pytest.mark.parametrize("option", ["--laws=guided", "--rate-hz=20", "--set=vessel_sim.seed=1", "--suite=guided"])
def test_compare_takes_no_option_of_a_simulation_for_recorded_runs(tmp_path: Path, option: str) -> None:
    arguments = ["compare", str(tmp_path), option, "--output", str(tmp_path / "there")]
    done = CliRunner().invoke(cli, arguments, standalone_mode=False)
    assert isinstance(done.exception, click.UsageError)


@pytest.mark.parametrize("heading", ["0", "1"])
def test_goto_takes_one_heading(namespaces: list[str], heading: str) -> None:
    done = CliRunner().invoke(cli, ["goto", "1", "2", heading, "--heading-deg", "0"], standalone_mode=False)
    assert isinstance(done.exception, click.UsageError)
    assert namespaces == []


def test_compare_takes_the_rows_of_a_suite_after_the_scenarios(reach: Reach, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("rows:\n  - {name: first, at_most: 3}\n  - {name: second, legs_at_most: 4}\n")
    found = reach("vessel_hsmc_ros.studies.comparison.compare", "compare", "goal", "--suite", "mine.yaml", "--laws", "guided")
    rows = [(task.row.name, task.row.at_most, task.row.legs_at_most, task.rate_hz) for task in found["tasks"]]
    assert rows == [("goal", None, None, None), ("first", 3, None, None), ("second", None, 4, None)]
    assert found["jobs"] is None


def test_changes_of_the_command_line_take_precedence_over_those_of_a_suite(reach: Reach, tmp_path: Path) -> None:
    row = "{name: short, set: {vessel_sim.duration: 9.0, vessel_sim.seed: 4}}"
    (tmp_path / "mine.yaml").write_text(f"set: {{vessel_sim.duration: 8.0}}\nrows:\n  - {{name: first}}\n  - {row}\n")
    options = "--suite", "mine.yaml", "--laws", "guided", "--set", f"{DURATION}=2.5"
    found = reach("vessel_hsmc_ros.studies.comparison.compare", "compare", *options)
    assert [task.row.changes for task in found["tasks"]] == [{DURATION: 2.5}, {DURATION: 2.5, "vessel_sim.seed": 4}]


def test_sweep_repeats_its_points_for_each_law_on_so_many_workers(reach: Reach) -> None:
    axes = "controller.guided.position_gain=0.5,0.6", "controller.rate_hz=20,50"
    options = "--laws", "guided,los_pid", "--workers", 3, "--set", f"{DURATION}=2.5"
    found = reach("vessel_hsmc_ros.studies.campaign.execute.compute_rows", "sweep", "case2_tracking", *axes, *options)
    plan = found["campaign"]
    points = [(plan.planned(run).law, *plan.planned(run).values.values()) for run in found["runs"]]
    assert points == [(law, gain, rate) for gain in (0.5, 0.6) for rate in (20, 50) for law in ("guided", "los_pid")]
    assert {plan.scenario(run).vessel_sim.duration for run in found["runs"]} == {2.5}
    assert found["workers"] == 3


def test_simulate_takes_changes_folder_and_bag(reach: Reach) -> None:
    options = "--set", f"{DURATION}=2.5", "--output", "there"
    for more, with_bag in (((), True), (("--no-bag",), False)):
        found = reach("vessel_hsmc_ros.studies.scenario_run.run_offline", "simulate", "case2_straight", *options, *more)
        scenario = found["scenario"]
        assert (scenario.name, scenario.vessel_sim.duration, found["parent"]) == ("case2_straight", 2.5, Path("there"))
        assert found["with_bag"] is with_bag
        assert found["with_page"]


@pytest.mark.parametrize(
    ("more", "target"),
    [
        ((), "studies.scenario_run.run_nodes"),
        (("--vessels", "2"), "cli.run.run_fleet"),
        (("--vessels", "2", "--spacing", "9"), "cli.run.run_vessels"),
    ],
)
def test_a_run_without_a_page_requests_none(
    reach: Reach, monkeypatch: pytest.MonkeyPatch, more: tuple[str, ...], target: str
) -> None:
    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.reserve_namespace", lambda *_: nullcontext())
    monkeypatch.setattr("vessel_hsmc_ros.cli.run.reserve_namespaces", lambda *_: nullcontext())
    for options, with_page in (("--no-page",), False), ((), True):
        assert reach(f"vessel_hsmc_ros.{target}", "run", "case2_straight", *more, *options)["with_page"] is with_page


def test_run_takes_changes_folder_namespace_pace_faults_and_live_view(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    reserved: list[tuple[str, bool]] = []
    ports: list[int] = []

    def reserve(namespace: str, lockstep: bool = True) -> Any:
        reserved.append((namespace, lockstep))
        return nullcontext()

    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.reserve_namespace", reserve)
    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.check_live_port", ports.append)
    Path("late.yaml").write_text("faults:\n  - {at: 1.5, duration: 0.5, kind: drop, topic: odom}\n")
    target = "vessel_hsmc_ros.studies.scenario_run.run_nodes"
    found = reach(target, "run", "case2_straight", "--set", f"{DURATION}=2.5", "--output", "there", "--namespace", "/boat/")
    scenario = found["scenario"]
    assert (scenario.vessel_sim.duration, scenario.controller.lockstep, found["namespace"]) == (2.5, True, "boat")
    assert found["folder"].path.parent == Path("there")
    assert (found["live_port"], found["faults"]) == (None, None)
    found = reach(target, "run", "case2_straight", "--real-time", "--live", "--live-port", 9123, "--faults", "late.yaml")
    assert found["scenario"].controller.lockstep is False
    assert found["live_port"] == 9123
    assert [(fault.kind, fault.at) for fault in found["faults"].faults] == [("drop", 1.5)]
    assert reserved == [("boat", True), ("", False)]
    assert ports == [9123]


def test_the_nodes_of_a_run_share_a_process_unless_each_is_to_have_its_own(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.reserve_namespace", lambda *_: nullcontext())
    for options, composed in ((), True), (("--composed",), True), (("--processes",), False):
        found = reach("vessel_hsmc_ros.studies.scenario_run.run_nodes", "run", "case2_straight", *options)
        assert found["composed"] is composed


def test_a_script_of_faults_replaces_that_of_the_scenario(reach: Reach, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.reserve_namespace", lambda *_: nullcontext())
    (tmp_path / "mine.yaml").write_text("faults:\n  - {at: 1.0, duration: 0.5, kind: drop, topic: odom}\n")
    (tmp_path / "other.yaml").write_text("faults:\n  - {at: 2.0, duration: 0.5, kind: drop, topic: reference}\n")
    for options, expected in ((), (1.0, "odom")), (("--faults", "other.yaml"), (2.0, "reference")):
        found = reach("vessel_hsmc_ros.studies.scenario_run.run_nodes", "run", "mine.yaml", *options)
        assert [(fault.at, fault.topic) for fault in found["faults"].faults] == [expected]


def test_run_with_vessels_takes_number_and_spacing(reach: Reach) -> None:
    options = "--vessels", 3, "--spacing", -40, "--namespace", "boat", "--output", "there", "--set", f"{DURATION}=2.5"
    found = reach("vessel_hsmc_ros.cli.run.run_vessels", "run", "case2_straight", *options)
    assert (found["count"], found["spacing"], found["namespace"], found["output"]) == (3, -40.0, "boat", Path("there"))
    assert found["base"].vessel_sim.duration == 2.5


@pytest.mark.parametrize("code", [0, 1, 130])
@pytest.mark.parametrize(("verb", "target"), [("simulate", "run_offline"), ("run", "run_nodes")])
def test_the_exit_code_is_that_of_the_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, verb: str, target: str, code: int
) -> None:
    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.reserve_namespace", lambda *_: nullcontext())
    result = RunResult(RunFolder(tmp_path), code, "it failed" if code else "")
    monkeypatch.setattr(f"vessel_hsmc_ros.studies.scenario_run.{target}", lambda *_, **__: result)
    done = CliRunner().invoke(cli, [verb, "case2_straight", "--output", str(tmp_path)])
    assert done.exit_code == code
    assert ("error: it failed" in done.output) == (code == 1)
    assert ("interrupted" in done.output) == (code == 130)  # Ctrl-C is no error


@pytest.mark.parametrize("place", ["--workers=3", "--scheduler=tcp://host:8786"])
def test_campaign_takes_number_seed_and_place_of_its_runs(reach: Reach, place: str, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(
        "scenario: case2_tracking\nruns: 40\ndraw:\n  vessel_sim.sensors.position_noise: {uniform: [0.1, 0.2]}\n"
    )
    target = "vessel_hsmc_ros.studies.campaign.execute.run_campaign"
    found = reach(target, "campaign", "mine.yaml", "--output", "there", "--runs", 12, "--seed", 5, place)
    assert (found["file"], found["folder"], found["runs"], found["seed"]) == ("mine.yaml", Path("there"), 12, 5)
    given = ("--workers", found["workers"]), ("--scheduler", found["scheduler"])
    assert [f"{name}={value}" for name, value in given if value] == [place]


def test_campaign_report_takes_folder_and_page(reach: Reach) -> None:
    found = reach("vessel_hsmc_ros.studies.campaign.report.make_report", "campaign", "report", "there", "--file", "page.html")
    assert found == {"folder": Path("there"), "output": Path("page.html")}


def test_tune_takes_all_that_makes_a_search(reach: Reach) -> None:
    gains = "--gain", "controller.los_pid.surge_gain=0.1:0.4", "--gain", "controller.los_pid.yaw_damping=1:9:log"
    objective = "--metric", "position_error_rms", "--second-metric", "surge_force_rms", "--aggregate", "worst"
    rest = "--trials", 17, "--seed", 5, "--workers", 3, "--held-out", "case2_slalom", "--set", f"{DURATION}=2.5"
    target = "vessel_hsmc_ros.studies.tuning.result.tune"
    found = reach(target, "tune", "case2_tracking", "--law", "los_pid", *gains, *objective, *rest, "--output", "there")
    tuning, given = found["tuning"], [*found.values()]
    assert [(case.name, case.scenario.vessel_sim.duration) for case in tuning.cases] == [("case2_tracking", 2.5)]
    assert [(gain.low, gain.high, gain.logarithmic) for gain in tuning.gains] == [(0.1, 0.4, False), (1.0, 9.0, True)]
    o = tuning.objective
    assert (o.metric, o.second, o.two, o.aggregate) == ("position_error_rms", "surge_force_rms", True, "worst")
    assert (tuning.law, tuning.seed, tuning.workers) == ("los_pid", 5, 3)
    assert given[1:3] == [Path("there"), 17]
    (unseen,) = given[3]
    assert (unseen.name, unseen.scenario.controller.law, unseen.scenario.vessel_sim.duration) == ("case2_slalom", "los_pid", 2.5)


def test_identify_reads_each_run_with_its_columns_and_namespace(reach: Reach) -> None:
    target = "vessel_hsmc_ros.studies.identification.measurements.from_csv"
    columns = "--column", "x=east", "--column", "surge_force=F=x"
    found = reach(target, "identify", "one.csv", *columns)
    assert found == {"path": Path("one.csv"), "columns": {"x": "east", "surge_force": "F=x"}}
    topics = "--odometry", "/odometry/filtered", "--wrench", "/thrust"
    found = reach(
        "vessel_hsmc_ros.studies.identification.measurements.from_bag", "identify", "bag", "--namespace", "boat", *topics
    )
    assert found == {"path": Path("bag"), "namespace": "boat", "odometry": "/odometry/filtered", "wrench": "/thrust"}


def test_identify_takes_model_vessel_window_and_held_out_runs(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vessel_hsmc_ros.studies.identification.study.measured", lambda path, *_: f"run of {path}")
    options = "--model", "linear", "--vessel", "otter", "--window", 7.5, "--held-out", "three", "--output", "there"
    found = reach("vessel_hsmc_ros.studies.identification.estimate.identify", "identify", "one", "two", *options)
    assert found["runs"] == ["run of one", "run of two"]
    assert (found["model"].name, found["window"]) == ("linear", 7.5)
    assert found["start"].length == read_vessel("otter").values["vessel.length"]
    monkeypatch.setattr("vessel_hsmc_ros.studies.identification.estimate.identify", lambda *_: "found")
    found = reach("vessel_hsmc_ros.studies.identification.study.judged", "identify", "one", "two", *options)
    assert (found["unused"], found["found"], found["start"].name, found["window"]) == (["run of three"], "found", "Otter", 7.5)
    monkeypatch.setattr("vessel_hsmc_ros.studies.identification.study.judged", lambda *_: "judged")
    named = "--name", "mine", "--length", 3.5, "--beam", 1.25
    found = reach("vessel_hsmc_ros.studies.identification.study.Target.write", "identify", "one", "two", *options, *named)
    target = found["self"]
    assert (target.name, target.folder, target.sizes) == ("mine", Path("there"), {"length": 3.5, "beam": 1.25})
    assert (found["runs"], found["held_out"], target.start.name) == (["run of one", "run of two"], "judged", "Otter")


def test_report_takes_all_that_describes_the_files(reach: Reach) -> None:
    target = "vessel_hsmc_ros.report.page.make"
    what = "--title", "Two boats", "--namespace", "boat", "--hull-length", 8.5, "--hull-beam", 2.25, "--file", "page.html"
    for flag, kinds in (("--csv", (True, False)), ("--parquet", (False, True))):
        found = reach(target, "report", "one", "two", *what, flag, "--figures", "svg")
        options = found["options"]
        assert (found["bags"], options.page, options.title) == ((Path("one"), Path("two")), Path("page.html"), "Two boats")
        assert (options.namespace, options.figures, (options.csv, options.parquet)) == ("boat", "svg", kinds)
        assert (options.hull.length, options.hull.beam) == (8.5, 2.25)


def test_manoeuvres_takes_ships_kinds_changes_and_folder(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    kinds = "--only", "crash_stop", "--only", "turning_circle"
    found = reach("vessel_hsmc_ros.studies.manoeuvres.run.run", "manoeuvres", "otter", *kinds, "--set", "vessel.length=3.5")
    assert (found["kinds"], found["ship"].scenario.vessel_sim.vessel.length) == (["crash_stop", "turning_circle"], 3.5)
    monkeypatch.setattr("vessel_hsmc_ros.studies.manoeuvres.run.run", lambda ship, *_: ship.name)
    monkeypatch.setattr("vessel_hsmc_ros.studies.manoeuvres.page.overview", lambda _: (["ship"], []))
    found = reach(
        "vessel_hsmc_ros.studies.manoeuvres.page.write", "manoeuvres", "otter", "cybership2", *kinds, "--output", "there"
    )
    assert found["folder"].parent == Path("there")
    assert "otter" in found["folder"].name
    assert found["results"] == "otter"


@pytest.fixture
def namespaces(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The namespaces in which verbs on running vessels look for nodes; they find a text in the place of them."""
    found: list[str] = []

    def running(namespace: str) -> Any:
        found.append(namespace)
        return nullcontext("remote")

    for module in ("sailing", "watch", "boat"):
        monkeypatch.setattr(f"vessel_hsmc_ros.cli.{module}.running_vessel", running)
    return found


@pytest.mark.parametrize(
    ("arguments", "pose"),
    [
        (["3", "-4"], (3.0, -4.0, None)),
        (["3", "-4", "0"], (3.0, -4.0, 0.0)),
        (["3", "-4", "1.5"], (3.0, -4.0, 1.5)),
        (["3", "-4", "--heading-deg", "0"], (3.0, -4.0, 0.0)),
        (["3", "-4", "--heading-deg", "-90"], None),
    ],
)
def test_goto_sends_the_pose_to_the_vessel(
    reach: Reach, namespaces: list[str], arguments: list[str], pose: tuple[float, float, float | None] | None
) -> None:
    pytest.importorskip("rclpy", reason="ROS is not installed")
    found = reach("vessel_hsmc_ros.nodes.remote.send_goal", "goto", "--detach", *arguments, "--namespace", "boat")
    assert namespaces == ["boat"]
    x, y, heading = [*found.values()][1:4]
    assert (x, y, heading) == (pose or (3.0, -4.0, pytest.approx(-1.5707963267948966)))


def test_path_set_and_check_take_the_vessel(reach: Reach, namespaces: list[str], tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="ROS is not installed")
    (tmp_path / "way.csv").write_text("1,2\n3,4,0.5\n")
    found = reach("vessel_hsmc_ros.nodes.remote.send_path", "path", "way.csv", "--detach", "--namespace", "one")
    assert [*found.values()] == ["remote", [(1.0, 2.0, 0.0), (3.0, 4.0, 0.5)]]
    found = reach("vessel_hsmc_ros.nodes.remote.change_parameters", "set", "a.x=1", "a.y=[2]", "--namespace", "two")
    assert [*found.values()] == ["remote", {"a.x": 1, "a.y": [2]}]
    given = "--seconds", 3, "--interface", "mavros", "--pulse", "30,-20", "--yes", "--namespace", "three"
    found = reach("vessel_hsmc_ros.cli.boat._observed", "check", *given)
    assert (found["namespace"], found["stack"].name, found["limit"], found["size"]) == ("three", "mavros", 3.0, (30.0, -20.0))
    assert namespaces == ["one", "two"]


@pytest.mark.parametrize("option", [*schema.entries(MainData), "top_speed"])
def test_every_datum_of_a_ship_arrives_by_its_option(
    reach: Reach, monkeypatch: pytest.MonkeyPatch, option: str, tmp_path: Path
) -> None:
    found = reach("vessel_hsmc_ros.cli.boat._text", "init", "there/boat", f"--{option.replace('_', '-')}", 0.75)
    assert found["given"] == {"speed" if option == "top_speed" else option: 0.75}
    assert (found["vessel"], found["path"], found["thrusters"], found["fixed"]) == (None, Path("there/boat.yaml"), False, ())


def test_init_takes_vessel_thrusters_and_check(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    found = reach("vessel_hsmc_ros.cli.boat._text", "init", "boat", "--vessel", "otter", "--thrusters")
    assert (found["vessel"], found["thrusters"]) == ("otter", True)
    found = reach("vessel_hsmc_ros.cli.boat._text", "init", "boat", "--thruster", "1,2,3,4", "--thruster", "1,-2,3,4")
    assert (found["vessel"], found["fixed"]) == (None, ("1,2,3,4", "1,-2,3,4"))
    monkeypatch.undo()
    written: list[str] = []
    monkeypatch.setattr(boat, "write_new", lambda path, _: written.append(path.name))
    monkeypatch.setattr(boat, "_check", lambda _: written.append("checked"))
    for more in ((), ("--no-check",)):
        CliRunner().invoke(cli, ["init", "boat", "--length", "5", *more], catch_exceptions=False)
    assert written == ["boat.yaml", "checked", "boat.yaml"]


def test_replay_verifies_and_repeats_with_its_own_changes(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    class OpenedBag:
        """A bag whose scenario is its changes."""

        def namespace(self, name: str | None) -> str:
            return f"/{name}/"

        def scenario(self, changes: dict[str, object], namespace: str) -> tuple[dict[str, object], str]:
            return changes, namespace

    bag = OpenedBag()
    monkeypatch.setattr("vessel_hsmc_ros.bags.reader.open_bag", lambda _: bag)
    monkeypatch.setattr("vessel_hsmc_ros.cli.recordings.check_effects", lambda *_, **__: [])  # it reads a whole scenario
    verified = "--verify", "--set", "controller.rate_hz=50", "--namespace", "boat"
    found = reach("vessel_hsmc_ros.studies.verification.verify", "replay", "bag", *verified)
    assert [*found.values()][:3] == [bag, ({"controller.rate_hz": 50}, "/boat/"), "boat"]
    again = "--with", "controller.rate_hz=20", "--namespace", "boat", "--output", "there"
    found = reach("vessel_hsmc_ros.studies.verification.rerun", "replay", "bag", *again)
    assert [*found.values()] == [bag, {"controller.rate_hz": 20}, "boat", Path("there")]
    published = "--rate", 2.5, "--topic", "/odom", "--topic", "/reference"
    for flag, flags in (("--loop", (True, False)), ("--paused", (False, True))):
        found = reach("vessel_hsmc_ros.cli.recordings._publish", "replay", "bag", *published, flag)
        assert (found["rate"], found["topics"], (found["loop"], found["paused"])) == (2.5, ("/odom", "/reference"), flags)


def test_ardupilot_takes_ship_wiring_address_and_duration(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    changes = "--set", "vessel_sim.rate_hz=200", "--set", "vessel_sim.vessel.length=7.5"
    wired = "--servos", "3,1", "--pulses", "1050,1450,1950"
    found = reach("vessel_hsmc_ros.cli.boat.Physics", "ardupilot", "case2_tracking", *changes, *wired)
    parameters, wiring = [*found.values()]
    assert (parameters.rate_hz, parameters.vessel.length) == (200.0, 7.5)
    assert (wiring.servos, [*wiring.pulses]) == ((3, 1), [1050.0, 1450.0, 1950.0])
    served = SimpleNamespace(frames=1, lost=2, repeated=3, time=4.0)
    monkeypatch.setattr("vessel_hsmc_ros.cli.boat.Physics", lambda *_: served)
    address = "--host", "10.0.0.1", "--port", 9123, "--duration", 2.5
    found = reach("vessel_hsmc_ros.cli.boat.serve", "ardupilot", "case2_tracking", *address)
    assert [*found.values()][:3] == [served, ("10.0.0.1", 9123), 2.5]


@pytest.mark.long
def test_reproduce_takes_its_folder_and_the_nodes(reach: Reach, monkeypatch: pytest.MonkeyPatch) -> None:
    target = "vessel_hsmc_ros.studies.paper.reproduction.run_cases"
    nodes = [reach(target, "reproduce", "--output", "there", *more)["nodes"] for more in ((), ("--ros",))]
    assert nodes[0] is None
    assert nodes[1].parent == Path("there")
    monkeypatch.setattr(target, lambda *_: "results")
    found = reach("vessel_hsmc_ros.studies.paper.reproduction.write", "reproduce", "--output", "there")
    assert (found["results"], found["folder"]) == ("results", Path("there"))


def options_of(command: click.Command) -> list[str]:
    """The options of a verb."""
    if isinstance(command, click.Group):
        return [option for verb in command.commands.values() for option in options_of(verb)]
    return [param.opts[0] for param in command.params if isinstance(param, click.Option) and not param.hidden]


def test_every_option_of_every_verb_has_a_test() -> None:
    """Those that print in another form, or take effect before the verb, have theirs elsewhere."""
    elsewhere = {"--json", "--markdown", "--once", "--law-file", "--interpreted", "--campaign", "--run"}
    files = sorted(Path(__file__).parent.glob("test_options*_arrive.py"))
    text, context = "".join(file.read_text(encoding="utf-8") for file in files), click.Context(cli)
    for verb in VERBS:
        command = cli.get_command(context, verb)
        assert command is not None
        names = {*options_of(command)} - elsewhere
        if verb != "init":
            names -= {f"--{name.replace('_', '-')}" for name in schema.entries(MainData)}
        assert [name for name in sorted(names) if f'"{name}' not in text and f" {name}" not in text and verb != "init"] == []
