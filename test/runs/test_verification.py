"""Commands computed again from a bag, and a bag's scenario run again; without ROS."""

import shutil

import numpy as np
import pytest
from bag_making import PERIOD, TYPES, message, serialized, topic
from click.testing import CliRunner

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.repair import repair
from vessel_hsmc_ros.bags.writer import PARAMETERS, SCENARIO, BagWriter
from vessel_hsmc_ros.cli.main import cli
from vessel_hsmc_ros.control.control_loop import ControlLoop
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.runs.verification import verify
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario, make_law, make_observer

STEPS = 300
NAMES = ("odom", "reference", "cmd_wrench", "applied_wrench", "disturbance")


def record(directory, changes=None, namespace="/"):
    """A bag as lockstep nodes would leave it: the ship goes its way whatever the law commands."""
    scenario = load_scenario("case2_tracking", changes)
    rng = np.random.default_rng(0)
    loop = ControlLoop(make_law(scenario.controller), RateGrid(scenario.controller.rate_hz), make_observer(scenario.controller))
    writer = BagWriter(directory, notes={"scenario": "made"})
    writer.attach(SCENARIO, dump_scenario(scenario))
    topics = {name: topic(namespace + name, TYPES[name]) for name in NAMES}
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
    writer.close()
    return directory


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    return record(tmp_path_factory.mktemp("recorded") / "bag")


@pytest.mark.parametrize(
    "changes",
    [
        {"controller.law": "guided"},
        {"controller.rate_hz": 50.0, "controller.law": "guided"},
        {"controller.observer.enabled": True, "controller.law": "guided"},
        {"controller.law": "los_pid"},
    ],
)
def test_every_law_gives_the_same_bits_again(tmp_path, changes):
    bag = open_bag(record(tmp_path / "bag", changes))
    found = verify(bag, bag.scenario())
    assert found.largest == (0.0, 0.0)
    assert len(found.differing) == 0
    assert len(found.time) == STEPS


def test_with_another_parameter_they_differ_and_it_says_where(recorded):
    bag = open_bag(recorded)
    assert verify(bag, bag.scenario()).largest == (0.0, 0.0)
    found = verify(bag, bag.scenario({"controller.hierarchical.surge_surface_slope": 0.31}))
    assert found.largest[0] > 0.0
    assert found.differing[0] == 0


def test_one_command_that_was_changed_is_found(recorded):
    bag = open_bag(recorded)
    column = bag["cmd_wrench"]["wrench.torque.z"]
    column[123] = np.nextafter(column[123], np.inf)
    found = verify(bag, bag.scenario())
    assert found.differing.tolist() == [123]
    assert found.largest[1] > 0.0
    column[123] = np.nan
    assert np.isnan(verify(bag, bag.scenario()).largest[1])


def test_a_bag_that_was_cut_off_is_verified_as_far_as_it_goes(recorded, tmp_path):
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


def test_where_a_reference_is_missing_it_ends(recorded):
    bag = open_bag(recorded)
    bag["reference"]["header.stamp.nanosec"][200] += 1
    found = verify(bag, bag.scenario())
    assert (len(found.time), found.beyond, len(found.differing)) == (200, 100, 0)


def test_what_cannot_be_verified_is_told(recorded, tmp_path):
    bag = open_bag(recorded)
    with pytest.raises(BagError, match="is of a real-time run"):
        verify(bag, bag.scenario({"controller.lockstep": False}))
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/odom", TYPES["odom"]))
    writer.close()
    with pytest.raises(BagError, match="has no message on /odom"):
        verify(open_bag(tmp_path / "bag"), bag.scenario())


def call(*arguments):
    return CliRunner().invoke(cli, ["replay", *map(str, arguments)])


def test_the_command_says_it_in_two_lines(recorded):
    done = call(recorded, "--verify")
    assert done.exit_code == 0
    assert done.output.splitlines() == [
        "300 commands over 2.99 s: max |delta tau| = 0 N, 0 N·m",
        "every command is bit-identical",
    ]
    done = call(recorded, "--verify", "--set", "controller.hierarchical.surge_surface_slope=0.31")
    assert done.exit_code == 1
    assert "300 commands differ, the first at t = 0 s: surge force" in done.output


def test_a_bag_whose_own_parameters_were_edited_does_not_verify(tmp_path):
    scenario = load_scenario("case2_tracking", {"controller.hierarchical.heading_weight": 101.0})
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


def test_a_scenario_is_run_again_with_a_change_and_both_lie_side_by_side(recorded, tmp_path):
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
    ("arguments", "told"),
    [
        (["--verify", "--rate", "2"], "exclude each other"),
        (["--verify", "--with", "controller.law=guided"], "exclude each other"),
        (["--set", "controller.law=guided"], "--set goes with --verify"),
        (["--with", "controller.law"], "--with controller.law is not allowed: it takes node.param=value"),
    ],
)
def test_options_that_do_not_go_together_are_refused(recorded, arguments, told):
    done = call(recorded, *arguments)
    assert done.exit_code != 0
    assert told in done.output + str(done.exception)


def test_a_recording_by_hand_is_known_by_what_the_nodes_told(tmp_path):
    scenario = load_scenario("case2_tracking", {"controller.law": "guided"})
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/alpha/odom", TYPES["odom"]))
    told = dump_scenario(scenario).replace("/**/", "/alpha/") + "/other: {ros__parameters: {speed: 3}}\n"
    writer.attach(PARAMETERS, told.replace("ros__parameters:\n", "ros__parameters:\n    use_sim_time: false\n"))
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert bag.scenario().controller == scenario.controller
    assert bag.parameters["/other"] == {"speed": 3}


def test_recover_says_what_it_did(recorded, tmp_path):
    shutil.copytree(recorded, tmp_path / "bag")
    path = tmp_path / "bag" / "bag_0.mcap"
    path.write_bytes(path.read_bytes()[:-1000])
    (tmp_path / "bag" / "metadata.yaml").unlink()
    done = CliRunner().invoke(cli, ["recover", str(tmp_path / "bag")])
    assert done.exit_code == 0, done.output
    assert "messages can be read; 1 of its files completed" in done.output
    assert "is complete: " in CliRunner().invoke(cli, ["recover", str(tmp_path / "bag")]).output
    assert open_bag(tmp_path / "bag").complete
    assert isinstance(CliRunner().invoke(cli, ["recover", str(tmp_path)]).exception, BagError)
