"""Recorded commands recomputed from a bag, and the verb `replay` with --verify and --with; without ROS."""

import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from bag_making import PERIOD, STORE, TYPES, message, serialized, topic
from click.testing import CliRunner, Result
from durations import rest_long
from unrendered import leave_unrendered

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import repair
from vessel_hsmc_ros.bags.writer import PARAMETERS, SCENARIO, BagWriter
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario
from vessel_hsmc_ros.studies.verification import parameter_changes, verify, version_note

STEPS = 300
NAMES = ("odom", "reference", "cmd_wrench", "applied_wrench", "disturbance")
EVENT = "rcl_interfaces/msg/ParameterEvent"


def record(
    directory: Path, changes: Mapping[str, object] | None = None, notes: Mapping[str, str] | None = None, events: bool = False
) -> Path:
    """A bag as lockstep nodes record it, with random odometry and references.

    Args:
        directory: The folder of the bag.
        changes: Changes of the scenario.
        notes: Facts about the recording.
        events: Record parameter events too: those of `write_parameter_events`.
    """
    scenario = load_scenario("case2_tracking", changes)
    rng = np.random.default_rng(0)
    loop = make_control_loop(scenario.controller)
    writer = BagWriter(directory, notes={"scenario": "made", **(notes or {})})
    writer.attach(SCENARIO, dump_scenario(scenario))
    topics = {name: topic("/" + name, TYPES[name]) for name in NAMES}
    for each in topics.values():
        writer.add_topic(each)
    for k in range(STEPS):
        made = {name: message(each.kind, k * PERIOD, rng) for name, each in topics.items()}
        state, reference = conversions.read_odometry(made["odom"]), conversions.read_reference(made["reference"])
        if loop.due(k * PERIOD):
            loop.step(k * PERIOD, state, *reference)
        wrench = made["cmd_wrench"].wrench
        wrench.force.x, wrench.torque.z = loop.wrench
        for name, each in topics.items():
            writer.write(each, serialized(made[name], each.kind), k * PERIOD, k * PERIOD)
    if events:
        write_parameter_events(writer)
    writer.close()
    return directory


def write_parameter_events(writer: BagWriter) -> None:
    """The controller declares a parameter at 0 s; another node changes one at 1 s, the controller at 2 s and 2.5 s."""
    events = topic("/parameter_events", EVENT)
    writer.add_topic(events)
    types = STORE.types
    arrays = {"byte": np.uint8, "bool": np.bool_, "integer": np.int64, "double": np.float64}
    empty = {f"{name}_array_value": np.zeros(0, kind) for name, kind in arrays.items()}
    scalars = {"bool_value": False, "integer_value": 0, "double_value": 1.0, "string_value": "", "string_array_value": []}
    value = types["rcl_interfaces/msg/ParameterValue"](type=3, **scalars, **empty)
    parameter = types["rcl_interfaces/msg/Parameter"](name="hierarchical_printed.sway_weight", value=value)
    for node, seconds, field in (
        ("/controller", 0.0, "new_parameters"),
        ("/other", 1.0, "changed_parameters"),
        ("/controller", 2.0, "changed_parameters"),
        ("/controller", 2.5, "changed_parameters"),
    ):
        stamp = round(seconds * 1e9)
        lists = {name: [parameter] * (name == field) for name in ("new_parameters", "changed_parameters", "deleted_parameters")}
        time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
        writer.write(events, serialized(types[EVENT](stamp=time, node=node, **lists), EVENT), stamp, stamp)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("recorded") / "bag")


@pytest.mark.parametrize(
    "changes",
    rest_long(
        [
            {"controller.law": "guided"},
            {"controller.rate_hz": 50.0, "controller.law": "guided"},
            {"controller.observer.enabled": True, "controller.law": "guided"},
            {"controller.law": "los_pid"},
        ]
    ),
)
def test_the_recomputed_commands_of_every_law_are_bit_identical(tmp_path: Path, changes: dict[str, object]) -> None:
    bag = open_bag(record(tmp_path / "bag", changes))
    found = verify(bag, bag.scenario())
    assert found.largest == (0.0, 0.0)
    assert len(found.differing) == 0
    assert len(found.time) == STEPS


def test_with_another_parameter_the_commands_differ_from_the_first_on(recorded: Path) -> None:
    bag = open_bag(recorded)
    assert verify(bag, bag.scenario()).largest == (0.0, 0.0)
    found = verify(bag, bag.scenario({"controller.hierarchical_printed.surge_surface_slope": 0.31}))
    assert found.largest[0] > 0.0
    assert found.differing[0] == 0


def test_a_single_modified_command_is_found(recorded: Path) -> None:
    bag = open_bag(recorded)
    column = bag["cmd_wrench"]["wrench.torque.z"]
    column[123] = np.nextafter(column[123], np.inf)
    found = verify(bag, bag.scenario())
    assert found.differing.tolist() == [123]
    assert found.largest[1] > 0.0
    column[123] = np.nan
    assert np.isnan(verify(bag, bag.scenario()).largest[1])


def test_a_truncated_bag_is_verified_up_to_its_end(recorded: Path, tmp_path: Path) -> None:
    shutil.copytree(recorded, tmp_path / "bag")
    path = tmp_path / "bag" / "bag_0.mcap"
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    for _ in range(2):
        bag = open_bag(tmp_path / "bag")
        found = verify(bag, bag.scenario())
        assert len(found.differing) == 0
        assert 50 < len(found.time) < STEPS
        assert len(found.time) + found.beyond == bag["odom"].count
        repair(tmp_path / "bag")


def test_verification_ends_at_the_first_missing_reference(recorded: Path) -> None:
    bag = open_bag(recorded)
    bag["reference"]["header.stamp.nanosec"][200] += 1
    found = verify(bag, bag.scenario())
    assert (len(found.time), found.beyond, len(found.differing)) == (200, 100, 0)


def test_a_bag_without_the_topics_of_a_run_is_refused(recorded: Path, tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/odom", TYPES["odom"]))
    writer.close()
    with pytest.raises(BagError, match="has no message on /odom"):
        verify(open_bag(tmp_path / "bag"), open_bag(recorded).scenario())


def test_a_real_time_bag_is_refused_since_only_lockstep_bags_can_be_verified(tmp_path: Path) -> None:
    directory = record(tmp_path / "bag", {f"{node}.lockstep": False for node in ("vessel_sim", "reference_ship", "controller")})
    with pytest.raises(BagError, match="is of a real-time run: only bags of lockstep runs can be verified"):
        verify(open_bag(directory), open_bag(directory).scenario())


def test_changes_of_the_controllers_parameters_are_found_and_no_other_events(recorded: Path, tmp_path: Path) -> None:
    bag = open_bag(record(tmp_path / "bag", events=True))
    assert parameter_changes(bag) == [2.0, 2.5]
    assert parameter_changes(open_bag(recorded)) == []


def test_a_failed_verification_names_the_first_change_of_a_parameter(recorded: Path, tmp_path: Path) -> None:
    changed = ["--verify", "--set", "controller.hierarchical_printed.surge_surface_slope=0.31"]
    line = "the controller's parameters were changed during the recording, first at t = 2 s"
    retuned = record(tmp_path / "bag", events=True)
    assert line in call(retuned, *changed).output.splitlines()
    assert line not in call(recorded, *changed).output
    assert "changed during the recording" not in call(retuned, "--verify").output


def test_the_versions_of_a_recording_are_compared_with_the_present_ones(recorded: Path, tmp_path: Path) -> None:
    assert version_note(open_bag(recorded)).startswith("recorded with the present versions: vessel_hsmc_ros ")
    bag = open_bag(record(tmp_path / "bag", notes={"numpy": "1.0.0"}))
    assert "NumPy 1.0.0, Python" in version_note(bag)
    assert f"recomputed with vessel_hsmc_ros {bag.recording['version']}, NumPy {np.__version__}" in version_note(bag)
    del bag.recording["numpy"]  # as in a bag from before they were recorded
    assert "NumPy of unknown version" in version_note(bag)


def call(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["replay", *map(str, arguments)])


def test_a_successful_verification_prints_two_lines_and_exits_with_0(recorded: Path) -> None:
    done = call(recorded, "--verify")
    assert done.exit_code == 0
    assert done.output.splitlines() == [
        "300 commands over 2.99 s: max |delta tau| = 0 N, 0 N·m",
        "every command is bit-identical",
    ]
    done = call(recorded, "--verify", "--set", "controller.hierarchical_printed.surge_surface_slope=0.31")
    assert done.exit_code == 1
    assert "300 commands differ, the first at t = 0 s: surge force" in done.output


def test_a_bag_with_edited_parameters_fails_and_shows_the_versions(tmp_path: Path) -> None:
    scenario = load_scenario("case2_tracking", {"controller.hierarchical_printed.heading_weight": 101.0})
    directory = record(tmp_path / "bag")
    (attached,) = {a.name: a for _, _, a in open_bag(directory).files[0].attachments}.values()
    assert attached.name == SCENARIO
    path = directory / "bag_0.mcap"
    content = path.read_bytes()
    assert content.count(b"heading_weight: 100.0") == 1
    path.write_bytes(content.replace(b"heading_weight: 100.0", b"heading_weight: 101.0"))
    assert open_bag(directory).scenario().controller == scenario.controller
    done = call(directory, "--verify")
    assert done.exit_code == 1
    assert "the first at t = 0 s" in done.output
    assert "recorded with the present versions" in done.output


@pytest.mark.long
def test_a_scenario_is_rerun_with_a_change_and_compared_with_the_recording(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_unrendered(monkeypatch)
    done = call(recorded, "--with", "controller.law=guided", "--output", tmp_path)
    assert done.exit_code == 0, done.output
    assert "position error, final" in done.output
    assert "controller.law" in done.output
    (folder,) = tmp_path.iterdir()
    assert folder.name.endswith("_made_again")
    assert load_scenario(folder / "params.yaml").controller.law == "guided"
    assert load_scenario(folder / "params.yaml").vessel_sim.duration == 2.99
    assert (folder / "figures" / "track.png").exists()
    assert "recorded" in (folder / "report.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--verify", "--rate", "2"], "exclude each other"),
        (["--verify", "--with", "controller.law=guided"], "exclude each other"),
        (["--set", "controller.law=guided"], "--set goes with --verify"),
        (["--with", "controller.law"], "--with must be node.param=value"),
    ],
)
def test_options_that_exclude_each_other_are_refused(recorded: Path, arguments: list[str], message: str) -> None:
    done = call(recorded, *arguments)
    assert done.exit_code != 0
    assert message in done.output + str(done.exception)


def test_without_an_attached_scenario_it_is_composed_of_the_recorded_parameters(tmp_path: Path) -> None:
    scenario = load_scenario("case2_tracking", {"controller.law": "guided"})
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/alpha/odom", TYPES["odom"]))
    parameters = dump_scenario(scenario).replace("/**/", "/alpha/") + "/other: {ros__parameters: {speed: 3}}\n"
    writer.attach(PARAMETERS, parameters.replace("ros__parameters:\n", "ros__parameters:\n    use_sim_time: false\n"))
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert bag.scenario().controller == scenario.controller
    assert bag.parameters["/other"] == {"speed": 3}
