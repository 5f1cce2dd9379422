"""The verbs on running nodes: what they do, and the one line that each error gives."""

import io
import math
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rclpy.node import Node
from rich.console import Console
from sensor_msgs.msg import NavSatFix

from vessel_hsmc_ros.cli.main import main
from vessel_hsmc_ros.cli.watch import line, table
from vessel_hsmc_ros.control.safety.parameters import Operation
from vessel_hsmc_ros.core.kinematics import Motion, wrap
from vessel_hsmc_ros.nodes import qos, remote
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.observation import NodeStatus, Snapshot
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_sim_node.node import VesselSimNode

RATE = {"lockstep": False, "rate_hz": 10.0}

Finished = tuple[int, str, str]
"""Exit code, output and error output."""


@pytest.fixture
def vessel_hsmc(
    bench: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Callable[..., Finished]]:
    """Run the command in this thread while another one serves the nodes of the bench."""
    running = True

    def serve() -> None:
        while running:
            bench.serve(wait=0.05)

    def run(*arguments: str) -> Finished:
        if not thread.is_alive():
            thread.start()
        monkeypatch.setattr("sys.argv", ["vessel-hsmc", *arguments])
        code = main()
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    monkeypatch.setenv("COLUMNS", "160")
    for limit in ("DISCOVERY_LIMIT", "ANSWER_LIMIT"):  # of which a busy machine needs more
        monkeypatch.setattr(remote, limit, 30.0)
    thread = threading.Thread(target=serve)
    yield run
    running = False
    if thread.is_alive():
        thread.join()


@pytest.mark.parametrize(
    ("stated", "given", "refusal"),
    [
        ([(63.44, 10.39)], (), ""),
        ([(63.44, 10.39)], ("--datum", "63.45,10.39"), "--datum must be that of /odom/datum, 63.44,10.39 (got 63.45,10.39)"),
        ([], ("--datum", "63.44,10.39"), "/odom/datum must have a datum (got none)"),
    ],
)
def test_a_mission_is_sent_in_the_plane_of_the_datum_that_the_odometry_states(
    bench: Any, vessel_hsmc: Any, tmp_path: Path, stated: list[tuple[float, float]], given: tuple[str, ...], refusal: str
) -> None:
    (tmp_path / "way.csv").write_text("lat,lon\n63.4405,10.39\n63.4405,10.392\n", encoding="utf-8")
    bench.start(ReferenceShipNode, mode="path", **RATE)
    publisher = bench.probe.create_publisher(NavSatFix, "odom/datum", qos.LATCHED)
    for latitude, longitude in stated:
        publisher.publish(NavSatFix(latitude=latitude, longitude=longitude))
    code, output, errors = vessel_hsmc("mission", str(tmp_path / "way.csv"), "--send", "--detach", *given)
    if refusal:
        assert code
        assert refusal in errors
        return
    assert (code, "path: 2 waypoints" in output) == (0, True), errors


def test_parameters_are_changed_together_or_not_at_all(bench: Any, vessel_hsmc: Any) -> None:
    node = bench.start(ControllerNode, law="guided", **RATE)
    bench.start(VesselSimNode, **RATE)
    gain, force = "controller.guided.position_gain", "vessel_sim.disturbance.periodic.surge_force"
    assert vessel_hsmc("set", f"{gain}=1", f"{force}=1e3") == (0, f"{gain}: 1.5 -> 1.0\n{force}: 1100.0 -> 1000.0\n", "")
    assert node.parameters.guided.position_gain == 1.0
    for wrong, reason in (
        ("controller.guided.positon_gain=1", "controller.guided.positon_gain is not a parameter: did you mean"),
        (
            "controller.rate_hz=20",
            "controller.rate_hz is set at the start and cannot be changed while the node runs: start it with"
            " --set controller.rate_hz=20",
        ),
        (f"{force}=1e20", f"{force} must be a finite number from"),
        (f"{force}=much", f"{force} must be a finite number from"),
        ("kontroller.rate_hz=20", "kontroller is not a node; did you mean controller?"),
        ("rate_hz=20", "rate_hz is not a parameter: it must be node.parameter"),
    ):
        code, output, error = vessel_hsmc("set", f"{gain}=0.5", wrong)
        assert (code, output) == (2, "")
        assert error.startswith(f"error: {reason}")
        assert error.count("\n") == 1
    assert node.parameters.guided.position_gain == 1.0


def test_a_parameter_of_another_law_is_refused(bench: Any, vessel_hsmc: Any) -> None:
    bench.start(ControllerNode, law="guided", **RATE)
    code, output, error = vessel_hsmc("set", "controller.los_pid.lookahead_distance=30")
    assert (code, output) == (2, "")
    assert error == (
        "error: controller.los_pid.lookahead_distance is not in use: it is of a law or mode that the node does not run\n"
    )


def test_nodes_are_paused_reset_and_stopped(bench: Any, vessel_hsmc: Any) -> None:
    for node_class in (VesselSimNode, ReferenceShipNode, ControllerNode):
        bench.start(node_class, **RATE, **({"law": "guided"} if node_class is ControllerNode else {}))
    assert vessel_hsmc("call", "pause") == (0, "vessel_sim: paused\nreference_ship: paused\n", "")
    assert vessel_hsmc("call", "resume") == (0, "vessel_sim: running\nreference_ship: running\n", "")
    assert vessel_hsmc("call", "stop") == (0, "controller: stopped: the wrench is zero until ~/rearm\n", "")
    code, _, error = vessel_hsmc("call", "enable")
    assert code == 1
    assert error.startswith("error: controller: not enabled: ")
    assert vessel_hsmc("call", "rearm") == (0, "controller: rearmed: in standby until ~/enable\n", "")
    assert vessel_hsmc("call", "disable") == (0, "controller: disabled: in standby, nothing is commanded\n", "")
    code, output, _ = vessel_hsmc("call", "reset")
    assert code == 0
    assert [line.split(":")[0] for line in output.splitlines()] == ["vessel_sim", "reference_ship", "controller"]


def test_a_goal_is_confirmed_by_the_reference(bench: Any, vessel_hsmc: Any) -> None:
    bench.start(ReferenceShipNode, mode="goal", frame_prefix="alpha/", **RATE)
    assert vessel_hsmc("goto", "--detach", "-15", "-3.5", "1.5") == (0, "goal: x = -15, y = -3.5, heading = 1.5\n", "")
    assert vessel_hsmc("goto", "--detach", "40", "20", "--heading-deg", "180")[1] == "goal: x = 40, y = 20, heading = 3.14159\n"
    _, without, _ = vessel_hsmc("goto", "--detach", "-1000", "1000")  # from a reference that is near the origin
    assert float(without.removeprefix("goal: x = -1000, y = 1000, heading = ")) == pytest.approx(0.75 * math.pi, abs=0.1)
    code, _, error = vessel_hsmc("goto", "--detach", "40", "20", "1", "--heading-deg", "90")
    assert code == 2
    assert "give the heading either as HEADING, in radians, or as --heading-deg" in error
    assert vessel_hsmc("goto", "nan", "20", "0")[2] == "error: goal must be finite numbers (got nan 20 0)\n"
    degrees = "HEADING must be in radians from -6.28 to 6.28; --heading-deg takes degrees (got 90)"
    assert vessel_hsmc("goto", "40", "20", "90")[2] == f"error: {degrees}\n"


@pytest.mark.long
def test_a_goal_that_is_refused_is_an_error_with_the_reason_of_the_reference(bench: Any, vessel_hsmc: Any) -> None:
    bench.start(ReferenceShipNode, mode="goal", **RATE)
    for _ in range(2):
        code, output, error = vessel_hsmc("goto", "--detach", "1e9", "0", "0")
        assert (code, output) == (1, "")
        assert error.startswith("error: /reference_ship: goal must be within 100 km of the reference at x = ")
        assert "(got x = 1e+09, y = 0, 1e+06 km)" in error
    assert vessel_hsmc("goto", "--detach", "9", "0", "0") == (0, "goal: x = 9, y = 0, heading = 0\n", "")


def test_a_goal_reaches_the_vessel_of_its_namespace_from_its_own_place_also_while_its_controller_is_stopped(
    bench: Any, vessel_hsmc: Any
) -> None:
    places = {"alpha": [1000.0, -500.0, 3.0], "beta": [-2000.0, 0.0, 0.0]}
    ships = {
        name: bench.start(ReferenceShipNode, namespace=name, mode="goal", frame_prefix=f"{name}/", initial_pose=place, **RATE)
        for name, place in places.items()
    }
    controller = bench.start(ControllerNode, namespace="alpha", law="guided", **RATE)
    assert vessel_hsmc("call", "stop", "--namespace", "alpha")[0] == 0
    for number, (name, (x, y, _)) in enumerate([*places.items(), *places.items()]):
        other = next(ship for vessel, ship in ships.items() if vessel != name)
        before = other._ship.target()
        goal = [x - 300.0 - 100.0 * number, y + 300.0 + 100.0 * number]
        code, output, error = vessel_hsmc("goto", "--detach", *map(str, goal), "--namespace", f"/{name}")
        assert (code, error) == (0, "")
        target = ships[name]._ship.target()
        assert [target.x, target.y] == goal, "the second one too"
        assert target.psi == pytest.approx(0.75 * math.pi, abs=0.01)
        assert output == f"goal: x = {goal[0]:g}, y = {goal[1]:g}, heading = {target.psi:g}\n"
        assert other._ship.target()[:3] == before[:3]
    assert controller.loop.supervision.operation is Operation.STOPPED


@pytest.mark.parametrize(("given", "heading"), [("190", -170.0), ("-190", 170.0), ("540", 180.0), ("-90", -90.0)])
def test_a_heading_of_a_goal_is_any_number_of_turns(bench: Any, vessel_hsmc: Any, given: str, heading: float) -> None:
    ship = bench.start(ReferenceShipNode, mode="goal", **RATE)
    assert vessel_hsmc("goto", "--detach", "5", "6", f"--heading-deg={given}")[0] == 0
    assert wrap(ship._ship.target().psi - math.radians(heading)) == pytest.approx(0.0, abs=1e-9)
    assert abs(ship._ship.target().psi) <= math.pi


def test_a_path_is_confirmed_by_the_reference(bench: Any, vessel_hsmc: Any, tmp_path: Path) -> None:
    bench.start(ReferenceShipNode, mode="path", **RATE)
    (tmp_path / "route.csv").write_text("x,y\n10,0\n10,20\n")
    confirmed = "path: 2 waypoints, the last at x = 10, y = 20\n"
    assert vessel_hsmc("path", "--detach", str(tmp_path / "route.csv")) == (0, confirmed, "")
    code, _, error = vessel_hsmc("goto", "--detach", "1", "2", "3")
    assert code == 1
    remedy = "start the run with --set reference_ship.mode=goal"
    assert error == f"error: /reference_ship accepts no goal: its mode is path; {remedy}\n"


@pytest.mark.long
def test_a_node_that_is_missing_is_named_beside_those_that_were_found(
    bench: Any, vessel_hsmc: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*arguments: str, there: str) -> str:
        """What the command reports when it has found a node that is there, for which a busy machine may take its time."""
        for limit in (1.5, 10.0):
            monkeypatch.setattr(remote, "DISCOVERY_LIMIT", limit)
            code, _, error = vessel_hsmc(*arguments)
            assert code == 1
            if there in error:
                break
        return str(error)

    absent = f"in ROS domain {os.environ['ROS_DOMAIN_ID']}: found are"
    error = refused("call", "pause", there="/probe")
    assert error.startswith(f"error: no node /vessel_sim, /reference_ship {absent} ")
    assert error.endswith("/probe\n")
    other = Node("controller", namespace="alpha", context=bench.context)
    bench.nodes.append(other)
    error = refused("call", "enable", there="/alpha/controller")
    assert error.startswith(f"error: no node /controller {absent} /alpha/controller, ")
    assert error.endswith("; for these the namespace is /alpha\n")
    assert vessel_hsmc("call", "enable", "--namespace", "no good")[0] == 2
    assert refused("watch", "--once", there="/alpha/controller").startswith(f"error: no node /vessel_sim, /controller {absent} ")


def test_the_present_state_is_shown_with_limits_and_the_messages_of_the_nodes() -> None:
    ship, desired = Motion(3.0, -4.0, 0.5, 1.0, 0.0, 0.0), Motion(3.0, -3.0, 0.5, 1.0, 0.0, 0.0)
    nodes = {"controller": NodeStatus("ok", "running", {"law": "guided"}), "vessel_sim": NodeStatus("error", "no command", {})}
    snapshot = Snapshot(1.5, ship, desired, (5e4, -3e6), (2e5, math.inf), {"odom": 0.1}, nodes, ["controller reset: done"])
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(table(snapshot))
    shown = {line.split("  ")[0].strip(): line for line in console.export_text().splitlines()}
    assert "x 3.00 m, y -4.00 m, heading 28.6 deg, 1.00 m/s surge" in shown["ship"]
    assert "50 kN, 25% of 200 kN" in shown["surge force"]
    assert "of" not in shown["yaw moment"]
    assert "ok  running (law guided)" in shown["controller"]
    assert {"time", "reference", "error", "age", "vessel_sim", "event"} <= shown.keys()
    assert "vessel_sim: no command" in line(snapshot)
    assert "controller: " not in line(snapshot)
