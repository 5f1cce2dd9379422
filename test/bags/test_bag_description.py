"""What a bag contains besides its messages: vessels, scenario, diagnostics, versions; and the example that prints it."""

import math
import platform
import runpy
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from bag_making import PERIOD, STATUS, TYPES, Recorded, serialized, status, topic, write_run

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError, ScenarioError
from vessel_hsmc_ros.core.install_paths import __version__
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario

VESSEL = VesselParameters().coefficients()
EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "open_bag.py"


def test_a_bag_describes_its_topics_times_and_metadata(recorded: Recorded) -> None:
    bag = open_bag(recorded[0])
    assert {name: series.type for name, series in bag.topics.items() if name != "/diagnostics"} == {
        name if name.startswith("/") else f"/{name}": kind for name, kind in TYPES.items()
    }
    assert bag.complete
    assert bag.count == 10 * 300 + 3
    assert (bag.start_time, bag.end_time) == (0, 299 * PERIOD)
    assert bag["odom"].type_hash.startswith("RIHS01_")
    assert bag["odom"].qos[0]["reliability"] == "reliable"
    assert bag.information["version"] == 9


def test_of_two_vessels_one_is_chosen_by_namespace(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    write_run(None, 10, namespace="/alpha/", close=False, writer=writer)
    write_run(None, 20, namespace="/beta/", writer=writer)
    bag = open_bag(tmp_path / "bag")
    assert bag.namespaces == ["/alpha/", "/beta/"]
    assert len(bag.run(VESSEL, "beta").time) == 20
    assert bag["/alpha/odom"].count == 10
    with pytest.raises(BagError, match="several vessels, in the namespaces /alpha/, /beta/: choose one"):
        bag.run(VESSEL)
    with pytest.raises(BagError, match="has 2 topics named odom: it has /alpha/odom, /beta/odom"):
        bag["odom"]


def test_a_vessel_whose_odometry_passes_through_the_fault_relay_is_one_vessel(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    write_run(None, 10, namespace="/alpha/", close=False, writer=writer)
    write_run(None, 10, namespace="/alpha/relayed/", writer=writer)
    assert open_bag(tmp_path / "bag").namespace() == "/alpha/"


def test_a_bag_without_a_scenario_takes_params_yaml_beside_it(recorded: Recorded, tmp_path: Path) -> None:
    shutil.copytree(recorded[0], tmp_path / "bag")
    with pytest.raises(ScenarioError, match=r"was recorded without its scenario, and .*params.yaml does not exist"):
        open_bag(tmp_path / "bag").scenario()
    scenario = load_scenario("case2_tracking", {"vessel_sim.vessel.surge_inertia": 2e5})
    (tmp_path / "params.yaml").write_text(dump_scenario(scenario))
    bag = open_bag(tmp_path / "bag")
    assert bag.scenario().vessel_sim.vessel.surge_inertia == 2e5
    assert (
        bag.scenario(
            {"controller.rate_hz": 200.0, "vessel_sim.rate_hz": 200.0, "reference_ship.rate_hz": 200.0}
        ).controller.rate_hz
        == 200.0
    )
    assert math.isclose(bag.run().disturbance[0, 0] * 2.0, bag.run(VESSEL).disturbance[0, 0] * VESSEL.m11 / 1e5)


def run_example(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["open_bag.py", str(bag)])
    runpy.run_path(str(EXAMPLE), run_name="__main__")


def test_the_example_describes_a_run(
    recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(recorded[0], tmp_path / "bag")
    (tmp_path / "params.yaml").write_text(dump_scenario(load_scenario("case2_tracking")))
    run_example(tmp_path / "bag", monkeypatch)
    printed = capsys.readouterr().out
    assert "3003 messages in 2.99 s" in printed
    assert "/odom: 300 of nav_msgs/msg/Odometry" in printed
    assert "the law was hierarchical_printed" in printed


def test_the_example_lists_the_topics_of_a_bag_without_a_run_and_ends_with_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/clock", TYPES["/clock"]))
    writer.close()
    with pytest.raises(SystemExit) as ended:
        run_example(tmp_path / "bag", monkeypatch)
    assert "/clock: 0 of rosgraph_msgs/msg/Clock" in capsys.readouterr().out
    assert str(ended.value).startswith("no run in this bag: bag ")
    assert "\n" not in str(ended.value)


def test_the_last_diagnostics_of_each_node_are_given_by_vessel(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    each = topic("/diagnostics", STATUS)
    odometry = [topic(f"{prefix}odom", TYPES["odom"]) for prefix in ("/", "/alpha/")]
    for added in (each, *odometry):
        writer.add_topic(added)
    rng = np.random.default_rng(7)
    for k, (node, text) in enumerate([("controller", "waiting"), ("alpha/controller", "other"), ("controller", "running")]):
        writer.write(each, serialized(status(k, rng, text, node), STATUS), k, k)
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert bag.diagnostics("/") == {"controller": {"message": "running"}}
    assert bag.diagnostics("alpha") == {"controller": {"message": "other"}}


def test_the_recording_names_the_versions_that_computed_it(recorded: Recorded) -> None:
    recording = open_bag(recorded[0]).recording
    assert recording["version"] == __version__
    assert recording["numpy"] == np.__version__
    assert recording["python"] == platform.python_version()
    assert open_bag(recorded[0]).information["custom_data"] == recording


def test_the_notes_of_a_recorder_that_was_killed_are_the_latest(tmp_path: Path) -> None:
    """A file has those of its beginning, until its end; metadata.yaml is brought up to date in between."""
    writer = BagWriter(tmp_path / "bag", notes={"messages_dropped": "0"})
    write_run(None, 10, close=False, writer=writer)
    writer.notes["messages_dropped"] = "3"
    writer.flush_metadata()
    assert open_bag(tmp_path / "bag").recording["messages_dropped"] == "3"
