"""The connection to an autopilot by itself: whose messages count, what a broken connection does, and what is requested."""

from types import SimpleNamespace
from typing import Any

import pytest
from sockets import free_port

pytest.importorskip("pymavlink", exc_type=ImportError)

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from vessel_hsmc_ros.boats import mavlink_link
from vessel_hsmc_ros.boats.mavlink_link import MOST_MESSAGES, Link

ARDUPILOT, NONE = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_INVALID
GIMBAL, COMPUTER = mavlink.MAV_COMP_ID_GIMBAL, mavlink.MAV_COMP_ID_ONBOARD_COMPUTER


class Wire:
    """Stands for the connection of pymavlink: gives the messages that wait, notes what is sent, and breaks with `error`."""

    def __init__(self) -> None:
        self.waiting: list[Any] = []
        self.sent: list[tuple[str, tuple[Any, ...]]] = []
        self.error = ""
        self.mav = self

    def recv_msg(self) -> Any:
        if self.error:
            raise OSError(self.error)
        return self.waiting.pop(0) if self.waiting else None

    def __getattr__(self, name: str) -> Any:
        def send(*values: Any) -> None:
            if self.error:
                raise OSError(self.error)
            self.sent.append((name.removesuffix("_send"), values))

        return send

    def close(self) -> None:
        """Nothing is open."""


def message(kind: str, system: int = 7, component: int = 1, autopilot: int = ARDUPILOT) -> Any:
    return SimpleNamespace(
        get_type=lambda: kind, get_srcSystem=lambda: system, get_srcComponent=lambda: component, autopilot=autopilot
    )


@pytest.fixture
def wires(monkeypatch: pytest.MonkeyPatch) -> list[Wire]:
    """The connections in the order in which they are opened."""
    made: list[Wire] = []

    def opened(*_: Any, **__: Any) -> Wire:
        made.append(Wire())
        return made[-1]

    monkeypatch.setattr(mavutil, "mavlink_connection", opened)
    return made


def link(target: int = 0) -> Link:
    return Link(f"udpin:127.0.0.1:{free_port()}", 115200, 255, target)


@pytest.mark.parametrize(
    "other",
    [
        message("HEARTBEAT", 8, 1, NONE),
        message("HEARTBEAT", 8, GIMBAL),
        message("HEARTBEAT", 8, COMPUTER, NONE),
        message("ATTITUDE", 8),
        message("BAD_DATA", 8),
    ],
    ids=["ground station", "gimbal", "computer", "no heartbeat", "bad data"],
)
def test_only_the_heartbeat_of_an_autopilot_decides_which_one_is_heard(wires: list[Wire], other: Any) -> None:
    made = link()
    wires[0].waiting = [other, message("ATTITUDE")]
    assert list(made.receive()) == []
    assert made.target == 0
    first = message("HEARTBEAT")
    wires[0].waiting = [other, first, other, message("HEARTBEAT", 9), message("ATTITUDE", 9)]
    assert list(made.receive()) == [first]
    assert made.target == 7


def test_of_the_target_only_the_autopilot_is_heard_and_its_bad_data_are_not(wires: list[Wire]) -> None:
    made = link(target=7)
    good = message("ATTITUDE")
    wires[0].waiting = [message("ATTITUDE", 7, GIMBAL), message("BAD_DATA"), message("HEARTBEAT", 8), good]
    assert list(made.receive()) == [good]


def test_a_flood_is_read_in_pieces_of_which_none_is_lost(wires: list[Wire]) -> None:
    made = link(target=7)
    wires[0].waiting = [message("ATTITUDE") for _ in range(MOST_MESSAGES + 3)]
    assert [len(list(made.receive())) for _ in range(3)] == [MOST_MESSAGES, 3, 0]


@pytest.mark.parametrize("breaks_in", ["receiving", "sending"])
def test_a_broken_connection_is_named_opened_again_and_used_again_each_time(wires: list[Wire], breaks_in: str) -> None:
    made = link(target=7)
    for number in (1, 2):
        wires[-1].error = f"cable {number}"
        if breaks_in == "receiving":
            assert list(made.receive()) == []
        else:
            made.heartbeat()
        assert made.broken == f"cable {number}"
        made.manual(0, 500)
        assert list(made.receive()) == [], "nothing raises while it is broken"
        made.reopen()
        assert (made.broken, len(wires), made.target) == ("", number + 1, 7)
        made.manual(0, 500)
        assert wires[-1].sent == [("manual_control", (7, 0, 0, 500, 0, 0))]


def test_a_message_is_requested_by_its_interval_or_once(wires: list[Wire]) -> None:
    made = link(target=7)
    made.request("ATTITUDE", 20.0)
    made.request("GPS_GLOBAL_ORIGIN", 0.0)
    interval, once = (values for _, values in wires[0].sent)
    assert interval[:6] == (7, 1, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, mavlink.MAVLINK_MSG_ID_ATTITUDE, 50_000.0)
    assert once[:6] == (7, 1, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, 0)


def test_a_velocity_has_the_mask_of_speed_and_yaw_rate_alone_and_a_time_that_fits(
    wires: list[Wire], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [1000.0]
    monkeypatch.setattr(mavlink_link, "time", SimpleNamespace(monotonic=lambda: now[0]))
    made = link(target=7)
    for elapsed in (0.5, 2.0**32 * 1e-3 + 0.25):
        now[0] = 1000.0 + elapsed
        made.velocity(0.5, -0.2)
    (early, *values), (late, *_) = (sent for _, sent in wires[0].sent)
    assert (early, late) == (500, 250), "it has 32 bits"
    assert values == [7, 1, 0b1000_0011, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, -0.2, 0.5]
