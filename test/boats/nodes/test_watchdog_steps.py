"""The watchdog and its input step by step: unlike times and values, each reason of a refusal, and each node by itself."""

import math
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_srvs.srv import Trigger
from stepped_node import SteppedNode

from vessel_hsmc_ros.boats import drive, takeover
from vessel_hsmc_ros.boats.drive import WatchdogNode
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import commands, reporting
from vessel_hsmc_ros.nodes.base import ERROR, LAST_COMMANDS, OK, WARN
from vessel_hsmc_ros.nodes.commands import CommandInput, is_nothing, nothing

Commands = list[tuple[float, float]]


class Watchdog(SteppedNode):
    """A watchdog with unlike times."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, **parameters: Any) -> None:
        modules = (drive, takeover, commands, reporting)
        given = {"command_timeout": 0.3, "ramp_time": 1.0, "heartbeat_timeout": 2.0, **parameters}
        super().__init__(bench, monkeypatch, WatchdogNode, modules, **given)
        self.input: CommandInput = self.node._input

    def command(self, force: float = 100.0, moment: float = -7.0, late: float = 0.0, frame: str | None = None) -> bool:
        """Whether a command is taken."""
        message = self.wrench(force, moment, late)
        message.header.frame_id = self.input._frame if frame is None else frame
        before = self.input.values()["taken"]
        self.node._on_command(message)
        return bool(self.input.values()["taken"] - before)

    def alive(self, *names: str) -> None:
        """Take diagnostics of some nodes."""
        self.node._on_diagnostics(DiagnosticArray(status=[DiagnosticStatus(name=name) for name in names]))

    def task(self, name: str) -> Any:
        return next(each for each in self.node.diagnostic_tasks() if each.name == name)


@pytest.fixture
def make(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda **parameters: Watchdog(bench, monkeypatch, **parameters)


def test_each_message_has_the_present_stamp_the_frame_and_its_share_of_both_values(make: Any) -> None:
    made = make(frame_prefix="alpha/")
    made.wait(0.05)
    made.command()
    for k in range(1, 16):
        made.wait(0.1)
        made.node._on_timer()
        topic, message = made.sent[-1]
        share = min(1.0, max(0.0, 1.0 - (0.1 * k - 0.3)))
        assert conv.read_wrench(message) == pytest.approx((100.0 * share, -7.0 * share), abs=1e-6)
        assert len(made.sent) == 1 + max(0, k - 3), "fresh commands are published as they come"
        if k > 3:
            assert conv.nanoseconds(message.header.stamp) == made.time.monotonic_ns()
        assert (topic, message.header.frame_id) == ("watched_wrench", "alpha/base_link")
    assert made.node.status()[2] == {"share": 0.0, "stopped": False}


@pytest.mark.parametrize("timeout", [0.05, 0.3, 1.7])
@pytest.mark.parametrize("ramp", [0.2, 1.0, 3.0])
def test_the_ramp_begins_at_the_time_out_without_a_step_whatever_the_times_are(make: Any, timeout: float, ramp: float) -> None:
    made, period = make(command_timeout=timeout, ramp_time=ramp), 0.02
    made.wait(0.7)
    for _ in range(2):
        while not made.sent or conv.read_wrench(made.sent[-1][1])[0] < 100.0:
            made.wait(period)
            made.command()
            made.node._on_timer()
        before, began = 100.0, made.time.seconds
        while before > 0.0:
            made.wait(period)
            made.node._on_timer()
            force = conv.read_wrench(made.sent[-1][1])[0]
            assert before - force <= 100.0 * period / ramp + 1e-6
            before = force
        assert made.time.seconds - began == pytest.approx(timeout + ramp, abs=2.1 * period)
        made.wait(0.5)
        made.node._on_timer()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_each_limit_holds_on_either_side(make: Any, side: float) -> None:
    made = make(surge_force_limit=50.0, yaw_moment_limit=4.0)
    for _ in range(2):
        made.wait(0.05)
        made.command(side * 60.0, side * 5.0)
        assert conv.read_wrench(made.sent[-1][1]) == (side * 50.0, side * 4.0)


def test_what_is_refused_during_a_stop_is_not_passed_on_during_it_or_after(make: Any) -> None:
    made = make()
    made.command(100.0, -7.0)
    made.stop()
    for refused in ({"force": math.nan}, {"force": 500.0, "frame": "map"}):
        made.wait(0.05)
        assert not made.command(**refused)
        made.node._on_timer()
        assert conv.read_wrench(made.sent[-1][1]) == (0.0, 0.0)
    made.stop(rearm=True)
    made.wait(0.1)
    made.node._on_timer()
    assert abs(conv.read_wrench(made.sent[-1][1])[0]) <= 10.0 + 1e-9


def test_the_first_command_is_passed_on_whole(make: Any) -> None:
    made = make(ramp_time=10.0)
    made.wait(0.02)
    assert made.command(100.0, -7.0)
    assert conv.read_wrench(made.sent[-1][1]) == (100.0, -7.0)


def test_each_watched_node_is_missed_for_itself_after_its_own_time_and_again(make: Any) -> None:
    names = ("controller", "vessel_sim", "reference_ship")
    made = make(watched_nodes=list(names))
    for silent in (*names, *names):
        made.alive(*names)
        for _ in range(3):
            made.wait(0.9)
            made.alive(*(name for name in names if name != silent))
        heartbeat = made.task("heartbeat")
        assert (heartbeat.level, heartbeat.message) == (ERROR, f"no diagnostics of {silent} for 2.7 s")
        ages = {f"{name}_age": (2.7 if name == silent else 0.0) for name in names}
        assert heartbeat.values == pytest.approx(ages)
        made.alive(silent)
        assert made.task("heartbeat").level == OK
    made.wait(1.9)
    assert made.task("heartbeat").level == OK
    made.wait(0.2)
    assert made.task("heartbeat").message == "no diagnostics of " + ", ".join(f"{name} for 2.1 s" for name in names)


def test_what_no_node_is_watched_for_is_no_problem(make: Any) -> None:
    made = make(watched_nodes=[""])
    made.wait(1e4)
    assert (made.task("heartbeat").level, made.task("heartbeat").values) == (OK, {})


def test_each_refusal_counts_under_its_reason_and_is_explained_with_its_numbers(
    make: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = make()
    conflict = [""]
    monkeypatch.setattr(made.input._publishers, "conflict", lambda: conflict[0])
    assert made.command()
    made.wait(0.1)
    assert made.command(late=0.02)
    cases: list[tuple[str, dict[str, Any], str]] = [
        ("stamp_old", {"late": 0.35}, r"must be stamped at most 0.3 s ago (got 0.350 s)"),
        ("stamp_future", {"late": -0.45}, r"must be stamped at most 0.1 s ahead (got 0.450 s)"),
        ("wrong_frame", {"frame": "map"}, r"must be in frame base_link (got 'map')"),
        ("not_finite", {"moment": math.nan}, r"must be finite numbers (got 100.0 N, nan N·m)"),
        ("duplicate", {"late": 0.02}, r"must be stamped after the last one, 1000.080000000 s (got 1000.080000000 s)"),
        ("out_of_order", {"late": 0.04}, r"must be stamped after the last one, 1000.080000000 s (got 1000.060000000 s)"),
        ("second_publisher", {}, "two publishers"),
    ]
    for count, (reason, how, text) in enumerate(cases, 1):
        conflict[0] = "two publishers" if reason == "second_publisher" else ""
        for _ in range(count):
            assert not made.command(**how)
        assert made.input.values()[f"refused_{reason}"] == count
        level, problem = made.input.problem()  # type: ignore[misc]
        assert text in problem
        assert level == (ERROR if conflict[0] else WARN)
    values = made.input.values()
    assert (values["taken"], values["refused"]) == (2, sum(range(1, 8)))
    assert values["age"] == pytest.approx(0.02)


def test_while_a_topic_has_two_publishers_what_was_taken_before_does_not_hold_either(
    make: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, conflict = make(), [""]
    monkeypatch.setattr(made.input._publishers, "conflict", lambda: conflict[0])
    made.command(5.0, 6.0)
    for text in ("two publishers", "", "two publishers", ""):
        conflict[0] = text
        assert made.input.present() == (None if text else (5.0, 6.0))


def test_the_age_is_that_of_the_stamp_and_none_is_infinite(make: Any) -> None:
    made = make()
    assert made.input.values()["age"] == math.inf
    made.command(late=0.05)
    made.wait(0.12)
    assert made.input.values()["age"] == pytest.approx(0.17)


def test_the_latest_command_holds_for_its_time_which_may_be_a_part_of_a_second(make: Any) -> None:
    made = make()
    for k, timeout in enumerate((0.3, 0.7, 0.12, 1.4)):
        made.change(command_timeout=timeout)
        made.command(10.0 * k, -3.0 * k)
        made.wait(timeout - 0.01)
        assert made.input.present() == (10.0 * k, -3.0 * k)
        made.wait(0.02)
        assert made.input.present() is None
        assert made.task("command").level == WARN


def test_silence_ends_a_command_also_where_the_clock_of_the_stamps_stands_still(
    make: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = make()
    monkeypatch.setattr(made.node, "now", lambda: 10**12)
    made.command()
    assert made.input.present()
    made.wait(0.31)
    assert made.input.present() is None


@pytest.mark.parametrize("back", [0.2, 5.0, 900.0])
def test_after_each_step_back_of_the_clock_commands_of_the_new_time_are_taken(
    make: Any, monkeypatch: pytest.MonkeyPatch, back: float
) -> None:
    made, offset = make(), [0]
    monkeypatch.setattr(made.node, "now", lambda: made.time.monotonic_ns() + offset[0])
    for _ in range(2):
        for k in range(3):
            made.wait(0.05)
            message = made.wrench(5.0 + k, 0.0)
            message.header.stamp = conv.time_message(made.node.now())
            made.node._on_command(message)
            assert made.input.present() == (5.0 + k, 0.0)
        offset[0] -= round(back * 1e9)
        assert made.input.present() is None, "it was stamped by another time"


def test_what_was_taken_before_a_reset_is_forgotten(make: Any) -> None:
    made = make()
    made.command()
    made.input.reset()
    assert made.input.present() is None
    assert made.command(late=0.1), "earlier than what was taken before"


@pytest.mark.parametrize("prefix", ["", "alpha/"])
def test_commands_are_taken_in_the_frame_of_the_own_hull_or_without_one(make: Any, prefix: str) -> None:
    made = make(frame_prefix=prefix)
    for frame, taken in ((f"{prefix}base_link", True), ("", True), ("beta/base_link", False), ("base_link", not prefix)):
        made.wait(0.01)
        assert made.command(frame=frame) is taken


def test_a_message_with_a_frame_or_a_number_is_a_command(make: Any) -> None:
    message = nothing(12_345_678_901)
    assert is_nothing(message)
    assert conv.nanoseconds(message.header.stamp) == 12_345_678_901
    assert all(math.isnan(value) for value in conv.read_wrench(message))
    for frame, force in (("base_link", math.nan), ("", 0.0)):
        other = nothing(1)
        other.header.frame_id, other.wrench.force.x = frame, force
        assert not is_nothing(other)


def test_a_rearmed_watchdog_ramps_up_and_a_forbidden_share_is_zero_at_once(make: Any) -> None:
    made = make()
    latch = made.node._latch
    assert latch.update(True) == 1.0
    made.wait(0.25)
    assert latch.update(False) == pytest.approx(0.75)
    made.wait(0.25)
    assert latch.update(True, allowed=False) == 0.0
    made.wait(0.4)
    assert latch.update(True) == pytest.approx(0.4)
    made.wait(0.1)
    assert latch.update(False) == pytest.approx(0.3)
    latch.stopped = True
    made.wait(0.5)
    assert latch.update(True) == 0.0
    made.wait(0.5)
    assert latch._rearm(Trigger.Request(), Trigger.Response()).success
    assert latch.share == 0.0
    assert latch.update(True) == pytest.approx(0.5)


@pytest.mark.parametrize("ended_in", ["commands", "ramp", "stop", "silence"])
def test_at_its_end_it_leaves_zero_with_stamps_that_no_consumer_takes_for_repetitions(make: Any, ended_in: str) -> None:
    made = make()
    for _ in range(3):
        made.wait(0.05)
        made.command()
    if ended_in == "stop":
        made.stop()
    elif ended_in != "commands":
        for _ in range(8 if ended_in == "ramp" else 40):
            made.wait(0.1)
            made.node._on_timer()
    count = len(made.sent)
    made.node.close()
    last = [message for _, message in made.sent[count:]]
    assert [conv.read_wrench(message) for message in last] == [(0.0, 0.0)] * LAST_COMMANDS
    stamps = [conv.nanoseconds(message.header.stamp) for message in last]
    assert len(set(stamps)) == LAST_COMMANDS
    assert stamps[-1] > conv.nanoseconds(made.sent[count - 1][1].header.stamp), "also where the clock stands still"
