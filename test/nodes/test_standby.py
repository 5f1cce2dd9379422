"""In real time a controller waits in standby unless `start_enabled` is given, and it is not enabled as a ship that it is not."""

from pathlib import Path
from typing import Any

import pytest
import rclpy
from driving import REFERENCE, STATE, RealTimePlant
from std_srvs.srv import SetBool
from vessel_hsmc_msgs.msg import ControlState, Event

from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.scenario.parameters import ControllerParameters
from vessel_hsmc_ros.scenario.scenario import for_nodes, load_scenario


@pytest.fixture
def sea(bench: Any, simulated_time: Any) -> RealTimePlant:
    return RealTimePlant(bench, simulated_time)


def enable(bench: Any, name: str = "controller") -> Any:
    return bench.call(SetBool, f"{name}/enable", SetBool.Request(data=True))


def test_by_default_a_controller_waits_for_a_person_and_a_run_with_its_own_plant_does_not() -> None:
    assert not ControllerParameters().start_enabled
    for real_time in (True, False):
        assert load_scenario("case2_tracking", for_nodes(True, real_time)).controller.start_enabled
    changes = {**for_nodes(True, True), "controller.start_enabled": False}
    assert not load_scenario("case2_tracking", changes).controller.start_enabled


def test_in_standby_the_log_has_the_call_that_enables_the_node_once(bench: Any, capfd: pytest.CaptureFixture[str]) -> None:
    for namespace in ("", "/alpha"):
        for lockstep, started in ((False, False), (False, True), (True, False)):
            node = bench.start(ControllerNode, lockstep, namespace, law="pd", start_enabled=started, vessel__length=32.0)
            capfd.readouterr()
            node.announce()
            command = (
                f"standby: nothing is commanded; enable by ros2 service call {namespace}/controller/enable std_srvs/srv/SetBool"
            )
            assert capfd.readouterr().err.count(command) == (not lockstep and not started)
            bench.stop(node)


def test_in_standby_and_after_a_stop_no_message_claims_that_the_safe_action_is_commanded(
    sea: RealTimePlant, capfd: pytest.CaptureFixture[str]
) -> None:
    node = sea.start(ControllerNode, law="guided", input_timeout=0.1, start_enabled=False)
    sea.run(0.2)
    sea.state = None
    sea.run(0.3)
    assert node.status()[1] == "no odometry for 0.1 s: nothing is commanded"
    sea.bench.probe.destroy_publisher(sea.odometry)
    sea.bench.until(lambda: not node.count_publishers("/odom"))
    sea.run(0.2)
    node.halt()
    sea.run(0.2)
    assert "safe action is commanded" not in capfd.readouterr().err


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        (
            {"vessel__surge_force_limit": 300.0},
            "only a part of the hull is given, of the paper's ship remain vessel.surge_inertia = ",
        ),
        ({"vessel__length": 4.0}, "vessel.sway_inertia = 177900 kg: give these too"),
    ],
)
def test_a_controller_with_a_part_of_a_hull_does_not_start_and_is_not_enabled(
    bench: Any, sea: RealTimePlant, settings: dict[str, float], reason: str
) -> None:
    node = sea.start(ControllerNode, law="guided", **{"vessel__length": 32.0, **settings})
    sea.run(0.3)
    assert not any(map(any, sea.wrenches()))
    assert sea.states[-1].operation == ControlState.STANDBY
    answer = enable(bench)
    assert not answer.success
    assert reason in answer.message
    assert reason in node.status()[1]


def test_a_controller_without_hull_data_is_not_enabled(bench: Any, sea: RealTimePlant) -> None:
    node = ControllerNode(context=bench.context, cli_args=["--ros-args", "-p", "law:=guided", "-p", "use_sim_time:=true"])
    bench.nodes.append(node)
    bench.executor.add_node(node)
    answer = enable(bench)
    assert not answer.success
    assert "no parameter describes the vessel" in answer.message
    assert "vessel:=paper_ship" in answer.message
    assert node.activate_quietly() is False


def test_a_reference_out_of_reach_is_refused_with_both_places_until_it_is_near(bench: Any, sea: RealTimePlant) -> None:
    sea.state = STATE.copy()
    sea.state[:2] = 597_000.0, 6_640_000.0
    sea.start(ControllerNode, law="guided", start_enabled=True)
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.STANDBY
    answer = enable(bench)
    assert not answer.success
    assert "m from the vessel at (597000, 6.64e+06) m, and must be within safety.enable_distance = 3200 m" in answer.message
    sea.desired = REFERENCE.copy()
    sea.desired[:2] = 597_003.0, 6_640_000.0
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.ACTIVE


SQUARE = [-50.0, -50.0, 50.0, -50.0, 50.0, 50.0, -50.0, 50.0, -50.0, -50.0]


def test_a_vessel_outside_of_its_fence_is_not_enabled_until_it_is_inside(bench: Any, sea: RealTimePlant) -> None:
    sea.state = STATE.copy()
    sea.state[:2] = 60.0, 0.0
    sea.start(ControllerNode, law="guided", start_enabled=True, safety__fence__inside=SQUARE)
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.STANDBY
    answer = enable(bench)
    assert not answer.success
    assert "the vessel at (60, 0) m is 10.0 m outside of safety.fence: steer it inside by hand" in answer.message
    sea.state = STATE
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.ACTIVE


def test_a_vessel_that_comes_too_near_to_its_fence_is_stopped_with_the_distances(
    sea: RealTimePlant, capfd: pytest.CaptureFixture[str]
) -> None:
    events = sea.bench.collect(Event, "events", qos.EVENTS)
    sea.start(ControllerNode, law="guided", start_enabled=True, safety__fence__inside=SQUARE, safety__fence__margin=5.0)
    sea.run(0.3)
    assert sea.states[-1].operation == ControlState.ACTIVE
    sea.state = STATE.copy()
    sea.state[:4] = 44.0, 0.0, 0.0, 2.0
    sea.run(0.3)
    assert (sea.states[-1].operation, sea.states[-1].reason) == (ControlState.SAFE, ControlState.FENCE)
    assert sea.wrenches()[-1][0] == pytest.approx(-2e5), "all of the force astern"
    sea.bench.until(lambda: any(each.kind == "fence" and "the fence is 6.0 m away" in each.text for each in events))
    err = capfd.readouterr().err
    assert "the vessel could not stop inside of the fence: the vessel stops in" in err
    assert "the fence is 6.0 m away, with a margin of 5.0 m; the safe action is commanded" in err


FILE = """\
/**:
  ros__parameters:
    vessel: {length: 4.0, surge_inertia: 550.0, sway_inertia: 700.0, yaw_inertia: 700.0}
    vessel.surge_force_limit: 300.0
    vessel.yaw_moment_limit: 250.0
/**/controller:
  ros__parameters: {law: guided, start_enabled: true}
/**/reference_ship:
  ros__parameters: {mode: goal}
"""


@pytest.mark.parametrize(
    ("remapped", "fits"),
    [("__node:=controller", True), ("__ns:=/alpha", True), ("__node:=ctl", False), ("__node:=my_controller", False)],
)
def test_a_renamed_controller_whose_section_is_not_met_is_not_enabled(tmp_path: Path, remapped: str, fits: bool) -> None:
    file = tmp_path / "boat.yaml"
    file.write_text(FILE, encoding="utf-8")
    line = ["--ros-args", "--params-file", str(file), "-r", remapped]
    context = rclpy.Context()
    rclpy.init(context=context, args=line)
    node = ControllerNode(command_line=line, context=context)
    try:
        missed = (
            f"no section for this node, {node.get_fully_qualified_name()}, in {file}, but for /**/controller, /**/reference_ship"
        )
        assert node.missed.startswith(missed) is not fits
        answer = node._serve_enable(SetBool.Request(data=True), SetBool.Response())
        assert not answer.success, "it has no inputs either"
        assert ("no section for this node" in answer.message) is not fits
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)
