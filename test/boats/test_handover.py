"""When commands pass to an autopilot, and who ends them for good."""

from typing import Any

import pytest

from vessel_hsmc_ros.boats.autopilot import Handover, Sticks

MANUAL, HOLD, ACTIVE, CRITICAL, EMERGENCY = 0, 4, 4, 5, 6
READY: dict[str, Any] = {"armed": True, "mode": MANUAL, "state": ACTIVE}


def commanding() -> Handover:
    """The handover of a controller that commands at 10 s."""
    handover = Handover(MANUAL, 3.0, {MANUAL: "MANUAL", HOLD: "HOLD"})
    handover.heartbeat(10.0, **READY)
    handover.controller(False, 10.0)
    assert handover.passes(10.0)
    return handover


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"mode": HOLD}, "mode HOLD, commands need MANUAL"),
        ({"mode": 42}, "mode 42, commands need MANUAL"),
        ({"armed": False}, "the autopilot is disarmed"),
        ({"state": CRITICAL}, "the autopilot reports a failsafe"),
        ({"state": EMERGENCY}, "the autopilot reports a failsafe"),
    ],
)
def test_a_change_ends_the_commands_until_the_controller_was_in_standby(change: dict[str, Any], text: str) -> None:
    handover = commanding()
    handover.heartbeat(11.0, **READY | change)
    assert handover.taken == text
    assert not handover.passes(11.0)
    handover.heartbeat(12.0, **READY)
    handover.controller(False, 12.0)
    assert not handover.passes(12.0), "it does not come back by itself"
    handover.controller(True, 12.1)
    assert not handover.passes(12.1)
    handover.controller(False, 12.2)
    assert handover.passes(12.2)


def test_lost_heartbeats_end_the_commands() -> None:
    handover = commanding()
    handover.check(13.0)
    assert handover.passes(13.0)
    handover.check(13.01)
    assert handover.taken == "no heartbeat of the autopilot for 3 s"


def test_a_gap_of_the_heartbeats_ends_the_commands_although_nothing_looked_at_it_before_the_next_one() -> None:
    handover = commanding()
    handover.heartbeat(13.01, **READY)
    assert handover.taken == "no heartbeat of the autopilot for 3 s"
    assert not handover.passes(13.01)


def test_a_controller_that_is_enabled_before_the_autopilot_is_ready_is_refused() -> None:
    handover = Handover(MANUAL, 3.0, {})
    handover.controller(False, 1.0)
    assert handover.taken == "no autopilot heard"


def test_in_standby_nothing_is_taken_over() -> None:
    handover = commanding()
    handover.controller(True, 11.0)
    handover.heartbeat(11.0, **READY | {"mode": HOLD})
    handover.take_over("a stick")
    assert not handover.taken
    assert handover.waits(11.0) == "mode HOLD, commands need MANUAL"


def sticks() -> Sticks:
    return Sticks((1, 3), 100.0)


def test_a_stick_that_leaves_its_place_is_named() -> None:
    watched = sticks()
    assert not watched.moved(1.0, [1510, 1500, 1480])
    assert not watched.moved(1.1, [1600, 1900, 1390]), "channel 2 is none of its channels"
    assert watched.moved(1.2, [1510, 1500, 1379]) == "channel 3 of the radio is at 1379 µs"
    watched.rest()
    assert not watched.moved(2.0, [1510, 1500, 1379]), "a new rest"


def test_a_stick_that_moves_soon_after_commands_of_before_standby_is_named() -> None:
    watched = sticks()
    for k in range(30):
        watched.sent(0.1 * k, {1: 1500, 3: 1900})
        assert not watched.moved(0.1 * k, [1500, 0, 1900])
    watched.rest()
    assert not watched.moved(3.0, [1500, 0, 1500]), "its place when the controller is enabled again"
    assert watched.moved(3.1, [1500, 0, 1900]) == "channel 3 of the radio is at 1900 µs"


def test_an_overridden_channel_must_show_what_was_sent() -> None:
    watched = sticks()
    for k in range(40):
        watched.sent(0.1 * k, {1: 1500, 3: 1500 + 10 * k})
        assert not watched.moved(0.1 * k, [1500, 0, 1500 + 10 * max(k - 5, 0)]), "half a second late"
    assert watched.moved(4.0, [1500, 0, 1500]) == "channel 3 of the radio is at 1500 µs"
    assert not watched.moved(9.0, [1500, 0, 1500]), "commands have ended: the stick is the pilot's"


@pytest.mark.parametrize("pause", ["commands end", "standby"])
def test_commands_that_begin_again_have_the_same_time_to_show_as_at_first(pause: str) -> None:
    watched = sticks()
    for begin in (0.0, 10.0, 20.0):
        for k in range(25):
            now = begin + 0.1 * k
            watched.sent(now, {1: 1500, 3: 1900})
            shown = 1500 if k < 10 else 1900
            assert not watched.moved(now, [1500, 0, shown]), "a second late"
        assert watched.moved(begin + 2.5, [1500, 0, 1500])
        if pause == "standby":
            watched.rest()
        else:
            assert not watched.moved(begin + 5.0, [1500, 0, 1500])


@pytest.mark.parametrize("width", [0, 65535])
def test_a_channel_without_a_signal_has_no_stick(width: int) -> None:
    watched = sticks()
    watched.moved(0.0, [1500, 1500, 1500])
    assert not watched.moved(1.0, [width, 1500])
    assert watched.moved(2.0, [width, 1500, 1900]) == "channel 3 of the radio is at 1900 µs", "those after it are watched"
