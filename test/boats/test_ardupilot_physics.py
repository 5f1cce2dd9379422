"""The ship as the physics of an autopilot: a peer of plain sockets steers it, repeats and loses frames, and starts anew."""

import json
import math
import socket
import struct
import threading
from typing import Any

import pytest
from click.testing import CliRunner
from sockets import free_port

from vessel_hsmc_ros.boats.autopilot import Pulses
from vessel_hsmc_ros.boats.plants import Outputs, Physics, Wiring
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.scenario.scenario import load_scenario

NEUTRAL = 1500
WIRING = Wiring((1, 3), Pulses(1100.0, 1500.0, 1900.0))
AT_REST = {"vessel_sim.initial_pose": [0.0, 0.0, 0.5 * math.pi]}


def physics(scenario: str = "waypoints", **changes: Any) -> Physics:
    return Physics(load_scenario(scenario, {**AT_REST, **changes}).vessel_sim, WIRING)


def frame(count: int, left: int = NEUTRAL, right: int = NEUTRAL) -> Outputs:
    return Outputs(50, count, (left, NEUTRAL, right, *[0] * 13))


def test_a_frame_is_a_period_and_a_repeated_one_is_answered_again() -> None:
    ship = physics()
    first = ship.answer(frame(0, 1900, 1900))
    assert json.loads(first)["timestamp"] == pytest.approx(ship.time)
    assert ship.answer(frame(0, 1900, 1900)) == first
    assert ship.answer(frame(1, 1900, 1900)) != first
    ship.answer(frame(4))
    assert (ship.frames, ship.repeated, ship.lost, ship.starts) == (3, 1, 2, 1)


def test_a_new_start_of_the_autopilot_starts_the_ship_anew_and_bit_identical() -> None:
    ship = physics()
    once = [ship.answer(frame(k, 1900, 1700)) for k in range(1, 50)]
    again = [ship.answer(frame(k, 1900, 1700)) for k in range(1, 50)]
    assert again == once
    assert ship.starts == 2


def test_ahead_is_north_and_more_thrust_to_port_turns_to_starboard() -> None:
    ship = physics()
    for k in range(200):
        state = json.loads(ship.answer(frame(k, 1900, 1900)))
    assert state["velocity"][0] > 0.5
    assert abs(state["velocity"][1]) < 0.05, "but for the wind"
    for k in range(200, 400):
        state = json.loads(ship.answer(frame(k, 1600, 1400)))
    assert state["imu"]["gyro"][2] > 0.0
    assert state["attitude"][2] > 0.0


def test_the_accelerometer_agrees_with_the_velocity() -> None:
    ship = physics()
    states = [json.loads(ship.answer(frame(k, 1900, 1500))) for k in range(100)]
    period = states[1]["timestamp"] - states[0]["timestamp"]
    north, east = ((states[-1]["velocity"][i] - states[-2]["velocity"][i]) / period for i in (0, 1))
    yaw = states[-1]["attitude"][2]
    ahead, starboard = states[-1]["imu"]["accel_body"][:2]
    turned = (ahead * math.cos(yaw) - starboard * math.sin(yaw), ahead * math.sin(yaw) + starboard * math.cos(yaw))
    assert turned == pytest.approx((north, east), abs=1e-3)


def test_thrusters_take_an_output_each() -> None:
    ship = physics(str(share_directory() / "config" / "thrusters" / "case2_thrusters.yaml"))
    state = json.loads([ship.answer(frame(k, 1100, 1100)) for k in range(50)][-1])
    assert state["velocity"][0] < 0.0


@pytest.mark.parametrize(
    ("left", "right", "shares"),
    [(1900, 1100, (1.0, -1.0)), (1100, 1900, (-1.0, 1.0)), (1300, 1700, (-0.5, 0.5)), (1500, 1460, (0.0, -0.1))],
)
def test_each_output_demands_a_share_of_what_its_thruster_has_ahead_or_astern(
    monkeypatch: pytest.MonkeyPatch, left: int, right: int, shares: tuple[float, float]
) -> None:
    ship = physics(
        str(share_directory() / "config" / "thrusters" / "case2_thrusters.yaml"),
        **{"vessel.thrusters.thrust_ahead": [2e5, 3e5], "vessel.thrusters.thrust_astern": [5e4, 7e4]},
    )
    applied, demands = ship._plant.applied_thrusts, []

    def noting(thrusts: Any, angles: Any) -> Any:
        demands.append(tuple(thrusts))
        return applied(thrusts, angles)

    monkeypatch.setattr(ship._plant, "applied_thrusts", noting)
    ship.answer(frame(0, left, right))
    limits = ((2e5, 5e4), (3e5, 7e4))
    assert demands == [
        pytest.approx([s * (ahead if s > 0 else astern) for s, (ahead, astern) in zip(shares, limits, strict=True)])
    ]


def test_a_wrong_number_of_outputs_is_an_error() -> None:
    with pytest.raises(ParameterError, match=r"--servos must be 2 numbers.*got 1"):
        Physics(load_scenario("waypoints").vessel_sim, Wiring((1,), WIRING.pulses))


def test_a_ship_without_limits_is_an_error() -> None:
    with pytest.raises(ParameterError, match="yaw_moment_limit must be finite"):
        physics("case2_tracking")


def test_the_command_serves_an_autopilot_of_plain_sockets() -> None:
    port, states = free_port(), []

    def autopilot() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.settimeout(0.2)
            count = 0
            while count < 200:  # the command ends before
                packet = struct.pack("<HHI16H", 18458, 50, count, 1900, NEUTRAL, 1900, *[0] * 13)
                try:
                    link.sendto(packet, ("127.0.0.1", port))
                    states.append(json.loads(link.recv(4096)))
                except OSError:  # not there yet, or no more
                    if states:
                        return
                    continue
                count += 1

    peer = threading.Thread(target=autopilot, daemon=True)
    peer.start()
    result = CliRunner().invoke(cli, ["ardupilot", "waypoints", "--port", str(port), "--duration", "1"])
    peer.join(30.0)
    assert not peer.is_alive()
    assert result.exit_code == 0, result.output
    assert "would like 50 Hz" in result.output
    assert states[-1]["timestamp"] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("arguments", [["--servos", "one"], ["--pulses", "1900,1500,1100"], ["--servos", "0,1"]])
def test_options_that_do_not_fit_are_an_error(arguments: list[str]) -> None:
    result = CliRunner().invoke(cli, ["ardupilot", "waypoints", *arguments])
    assert result.exit_code
    assert isinstance(result.exception, ParameterError)
