"""The failsafes of an autopilot as `vessel-hsmc check` shows them: read by the MAVLink node from a simulated one."""

import random
from collections.abc import Callable
from contextlib import closing
from typing import Any

import pytest
from durations import rest_long
from serving import served
from sockets import free_port

pytest.importorskip("pymavlink", exc_type=ImportError)

from mavlink_autopilot import Autopilot

from vessel_hsmc_ros.boats.mavlink import MavlinkNode
from vessel_hsmc_ros.boats.parameters import interface
from vessel_hsmc_ros.nodes.remote import Remote
from vessel_hsmc_ros.preflight.connection import OK, TODO, WRONG, Finding
from vessel_hsmc_ros.preflight.failsafe_rules import judge_failsafes
from vessel_hsmc_ros.preflight.live import LiveConnection

STATE = (30.0, -4.0, 2.5, 1.2, -0.3, 0.1)
DEFAULTS = {
    **{"FS_ACTION": 2, "FS_TIMEOUT": 1.5, "FS_THR_ENABLE": 1, "FS_GCS_ENABLE": 0, "FS_GCS_TIMEOUT": 5, "FS_CRASH_CHECK": 0},
    **{"FS_EKF_ACTION": 1, "FS_EKF_THRESH": 0.8, "FENCE_ENABLE": 0, "FENCE_ACTION": 1, "FENCE_TYPE": 6, "RC_OVERRIDE_TIME": 3},
    **{"RC_OPTIONS": 0, "MOT_THR_MIN": 0, "SYSID_MYGCS": 255, "BATT_MONITOR": 0, "BATT_FS_LOW_ACT": 0, "BATT_LOW_VOLT": 0},
}
"""Those of ArduPilot's surface vehicles as they come, SYSID_MYGCS being the older of two names."""

OFF = {"FS_ACTION": 0, "FS_THR_ENABLE": 0, "FS_EKF_ACTION": 0, "RC_OVERRIDE_TIME": -1, "RC_OPTIONS": 1, "SYSID_MYGCS": 1}


def shown(bench: Any, autopilot: Autopilot, complete: Callable[[dict[str, Finding]], bool]) -> dict[str, Finding]:
    """The lines of the check once they are complete."""

    def step() -> None:
        autopilot.receive()
        autopilot.report(STATE)
        bench.serve(wait=0.02)

    with closing(autopilot), served(step), Remote() as remote:
        live = LiveConnection(remote, interface("mavlink"))

        def lines() -> dict[str, Finding]:
            return {found.about: found for found in judge_failsafes(live.connection())}

        assert remote.until(lambda: complete(lines()), 30.0), lines()
        return lines()


def boat(bench: Any, **parameters: Any) -> Autopilot:
    port = free_port()
    bench.start(MavlinkNode, lockstep=False, connection=f"udpin:127.0.0.1:{port}", **parameters)
    return Autopilot(f"udpout:127.0.0.1:{port}")


@pytest.mark.parametrize("seed", rest_long(range(3)))
def test_failsafes_that_are_off_are_found_over_the_link_of_the_node(bench: Any, seed: int) -> None:
    autopilot, off = boat(bench), dict(random.Random(seed).sample(sorted(OFF.items()), 3))  # noqa: S311
    autopilot.parameters = {**DEFAULTS, **off}
    found = shown(bench, autopilot, lambda lines: {"not shown" in line.text for line in lines.values()} == {False})
    wrong = {name for name, line in found.items() if line.level == WRONG}
    assert wrong - {"FS_GCS_ENABLE"} == set(off)
    assert found["FS_GCS_ENABLE"].level == WRONG, "as it comes"
    assert found["FENCE_ENABLE"].level == TODO


def test_a_silent_autopilot_and_a_link_without_requests_show_nothing(bench: Any) -> None:
    autopilot = boat(bench)
    autopilot.silent, autopilot.parameters = True, dict(DEFAULTS)
    found = shown(bench, autopilot, lambda lines: "hears no ArduPilot" in lines["failsafes"].text)
    assert [line.level for line in found.values()] == [TODO]


def test_nothing_is_requested_where_the_stream_is_switched_off(bench: Any) -> None:
    autopilot = boat(bench, stream_rate=0.0)
    autopilot.parameters = dict(DEFAULTS)
    found = shown(bench, autopilot, lambda lines: "stream_rate is 0" in lines["failsafes"].text)
    assert [line.level for line in found.values()] == [TODO]
    assert not [each for each in autopilot.heard if each.get_type() == "PARAM_REQUEST_READ"]


@pytest.mark.long
def test_a_parameter_that_a_person_corrects_is_read_again(bench: Any) -> None:
    autopilot = boat(bench)
    autopilot.parameters = {"FS_ACTION": 0.0}

    def corrected(lines: dict[str, Finding]) -> bool:
        found = lines.get("FS_ACTION")
        if found is not None and found.level == WRONG:
            autopilot.parameters = {"FS_ACTION": 2.0}
        return found is not None and found.level == OK

    shown(bench, autopilot, corrected)
