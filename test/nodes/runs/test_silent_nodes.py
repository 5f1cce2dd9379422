"""Which nodes are named when another gave up waiting: those that report nothing any more, whenever they reported last."""

from types import SimpleNamespace
from typing import Any

import pytest

supervisor = pytest.importorskip("vessel_hsmc_ros.nodes.runs.supervisor", reason="ROS is not installed")

PERIOD, LIMIT = 1.0, 1.75


def named(monkeypatch: pytest.MonkeyPatch, heard_at: dict[str, float], alive: set[str], failed_at: float) -> tuple[str, float]:
    """The end of the message about the nodes `a` and `b` of which some report every second, and when."""
    clock = [failed_at]
    listener = SimpleNamespace(heard_at=dict(heard_at))

    def listen(seconds: float) -> None:
        clock[0] += seconds
        if clock[0] % PERIOD < seconds:
            listener.heard_at.update(dict.fromkeys(alive, clock[0]))

    listener.listen = listen
    monkeypatch.setattr(supervisor, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    given: Any = listener
    return supervisor.silent_after(given, {"a", "b"}, LIMIT), clock[0]


@pytest.mark.parametrize("age", [0.01, 0.9, 1.8, 3.4])
def test_a_node_that_hangs_is_named_however_shortly_before_it_reported(monkeypatch: pytest.MonkeyPatch, age: float) -> None:
    text, ended_at = named(monkeypatch, {"a": 100.3 - age, "b": 100.2}, alive={"b"}, failed_at=100.3)
    assert text == f"; a has been silent for {ended_at - 100.3 + age:.1f} s"


def test_a_node_that_never_reported_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    assert named(monkeypatch, {"b": 100.2}, alive={"b"}, failed_at=100.3)[0] == "; a has been silent for 1.8 s"


def test_nodes_that_report_are_not_named_and_not_waited_for_longer_than_a_period(monkeypatch: pytest.MonkeyPatch) -> None:
    text, ended_at = named(monkeypatch, {"a": 99.4, "b": 99.9}, alive={"a", "b"}, failed_at=100.3)
    assert text == ""
    assert ended_at <= 101.1


@pytest.mark.parametrize(
    ("now", "named_nodes"), [(103.0, []), (103.6, ["a"]), (110.0, ["a"]), (119.0, ["a"]), (123.4, ["a", "b"])]
)
def test_a_node_hangs_where_others_report_and_the_machine_is_busy_where_none_does(
    monkeypatch: pytest.MonkeyPatch, now: float, named_nodes: list[str]
) -> None:
    monkeypatch.setattr(supervisor, "time", SimpleNamespace(monotonic=lambda: now))
    text = supervisor.silence({"a": 99.5, "b": min(now - 0.1, 103.3)}, 3.5)
    assert [name for name in ("a", "b") if f"{name} has been silent" in text] == named_nodes


def test_a_machine_that_is_busy_for_a_while_ends_no_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervisor, "time", SimpleNamespace(monotonic=lambda: 110.0))
    assert supervisor.silence({"a": 100.0, "b": 100.6, "c": 99.9}, 3.5) == ""


def test_a_node_that_is_given_time_to_start_again_makes_no_other_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervisor, "time", SimpleNamespace(monotonic=lambda: 100.0))
    assert supervisor.silence({"a": 99.0, "back": 115.0}, 3.5) == ""
