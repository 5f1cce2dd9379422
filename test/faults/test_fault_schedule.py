"""What the faults of a script make of the messages of a topic."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.faults import KINDS, Delivery, Fault, FaultScript, TopicSchedule

PERIOD = NANOSECONDS // 10
MESSAGE_KINDS = [name for name, kind in KINDS.items() if kind.target in ("topic", "actuator") and kind.lockstep]


def deliveries(*faults: Fault, count: int = 30, topic: str = "cmd_wrench", seed: int = 1) -> list[list[Delivery]]:
    """What is delivered with each of `count` messages, which come every 0.1 s and whose content is their number."""
    schedule = TopicSchedule(FaultScript(faults, seed), topic)
    return [schedule.take(number, number * PERIOD, number * PERIOD) for number in range(count)]


def fault(kind: str, **settings: Any) -> Fault:
    return Fault(**{"at": 1.0, "duration": 1.0, "kind": kind, "topic": "cmd_wrench", **settings})


def contents(steps: list[list[Delivery]]) -> list[list[int]]:
    return [[delivery.message for delivery in step] for step in steps]


PLAIN = [[number] for number in range(30)]


def test_without_faults_every_message_passes_unchanged() -> None:
    steps = deliveries()
    assert contents(steps) == PLAIN
    assert all(d.stamp == d.number * PERIOD and not d.edits for step in steps for d in step)


@pytest.mark.parametrize("kind", MESSAGE_KINDS)
def test_a_fault_acts_from_its_beginning_to_before_its_end(kind: str) -> None:
    acting = fault(kind, delay=0.05, field="wrench.force.x", offset=-0.1, frame="map", factor=0.5)
    steps = deliveries(acting)
    assert steps[:10] == deliveries()[:10]
    assert steps[21:] == deliveries()[21:]
    assert steps[10:20] != deliveries()[10:20]


@pytest.mark.parametrize("kind", MESSAGE_KINDS)
def test_a_fault_of_another_topic_does_nothing(kind: str) -> None:
    assert deliveries(fault(kind, topic="odom", delay=1.0, offset=1.0)) == deliveries()


def test_dropped_messages_are_lost() -> None:
    assert contents(deliveries(fault("drop"))) == [*PLAIN[:10], *([[]] * 10), *PLAIN[20:]]


def test_a_probability_hits_its_share_of_the_messages() -> None:
    steps = deliveries(Fault(at=0.0, kind="drop", topic="cmd_wrench", probability=0.3), count=10_000)
    assert sum(map(len, steps)) == pytest.approx(7000, abs=150)


def test_a_probability_of_zero_hits_none() -> None:
    assert deliveries(fault("drop", probability=0.0)) == deliveries()


def test_the_delays_of_two_faults_add_up_for_messages_that_were_late_before_too() -> None:
    schedule = TopicSchedule(FaultScript((fault("delay", delay=0.3), fault("delay", delay=0.2)), 1), "cmd_wrench")
    assert schedule.take(1, 10 * PERIOD, 13 * PERIOD) == []
    (pending,) = schedule._pending
    assert pending.due == 18 * PERIOD


def test_messages_whose_delays_differ_come_in_the_order_of_their_times() -> None:
    schedule = TopicSchedule(FaultScript((fault("delay", delay=0.2, jitter=2.0),), 1), "cmd_wrench")
    for number in range(10, 20):
        schedule.take(number, number * PERIOD, number * PERIOD)
    due = [delivery.due for delivery in schedule.due(60 * PERIOD)]
    assert len(due) > 5
    assert due == sorted(due)


def test_an_earlier_message_with_a_stamp_of_now_is_not_the_present_one() -> None:
    schedule = TopicSchedule(FaultScript(), "cmd_wrench")
    earlier, present = (schedule.take(number, 5 * PERIOD, 5 * PERIOD)[0] for number in (1, 2))
    assert not schedule.current(earlier, 5 * PERIOD)
    assert schedule.current(present, 5 * PERIOD)
    assert not schedule.current(present, 6 * PERIOD)


def test_two_faults_that_change_a_message_both_do() -> None:
    frame, weak = fault("frame", frame="map"), fault("weaken", factor=0.5)
    fields = [edit.field for edit in deliveries(frame, weak)[12][0].edits]
    assert fields == ["header.frame_id", "wrench.force.x", "wrench.torque.z"]


def test_delayed_messages_come_before_the_one_that_is_sent_when_they_are_due() -> None:
    steps = contents(deliveries(fault("delay", delay=0.25)))
    assert steps[10:14] == [[], [], [], [10]]
    assert steps[20:24] == [[17, 20], [18, 21], [19, 22], [23]]


def test_jitter_adds_up_to_itself_to_a_delay() -> None:
    due = [d.due - d.number * PERIOD for d in _pending(fault("delay", delay=5.0, jitter=2.0))]
    assert all(5.0 <= late / NANOSECONDS < 7.0 for late in due)
    assert len(set(due)) == 10


def _pending(delayed: Fault) -> list[Delivery]:
    schedule = TopicSchedule(FaultScript((delayed,)), "cmd_wrench")
    for number in range(30):
        schedule.take(number, number * PERIOD, number * PERIOD)
    return schedule.due(100 * NANOSECONDS)


def test_duplicated_messages_come_twice() -> None:
    assert contents(deliveries(fault("duplicate")))[9:12] == [[9], [10, 10], [11, 11]]


def test_a_reordered_message_comes_after_the_next() -> None:
    steps = contents(deliveries(fault("reorder", duration=0.1)))
    assert steps[9:13] == [[9], [], [11, 10], [12]]


def test_a_message_that_waits_for_one_that_is_lost_comes_once() -> None:
    found = contents(deliveries(fault("reorder", at=0.5, duration=0.1), fault("drop", at=0.6, duration=0.1), count=10))
    assert found == [[0], [1], [2], [3], [4], [], [5], [7], [8], [9]]


def test_a_frozen_topic_repeats_its_last_content_with_fresh_stamps() -> None:
    frozen = [step[0] for step in deliveries(fault("freeze"))[10:20]]
    assert {d.message for d in frozen} == {9}
    assert [d.stamp for d in frozen] == [number * PERIOD for number in range(10, 20)]


def test_stamps_are_off_by_the_offset_and_never_negative() -> None:
    stamps = [step[0].stamp for step in deliveries(fault("offset", offset=-1.5))[10:20]]
    assert stamps == [max(0, number * PERIOD - 1_500_000_000) for number in range(10, 20)]


@pytest.mark.parametrize(("kind", "factor"), [("lose", 0.0), ("weaken", 0.25), ("reverse", -1.0)])
@pytest.mark.parametrize(("component", "fields"), [("surge", ["wrench.force.x"]), ("yaw", ["wrench.torque.z"])])
def test_an_actuator_gives_a_factor_of_its_demand(kind: str, factor: float, component: str, fields: list[str]) -> None:
    ((delivery,),) = deliveries(fault(kind, component=component, factor=0.25), count=11)[10:]
    assert [(edit.field, edit.change, edit.value) for edit in delivery.edits] == [(f, "scale", factor) for f in fields]


@pytest.mark.parametrize(("change", "value"), [("nan", math.nan), ("inf", math.inf), ("huge", 1e30)])
def test_a_corrupted_field_is_set(change: str, value: float) -> None:
    ((delivery,),) = deliveries(fault("corrupt", field="wrench.force.x", change=change), count=11)[10:]
    assert [(e.field, e.change, str(e.value)) for e in delivery.edits] == [("wrench.force.x", "set", str(value))]


def test_a_flipped_bit_differs_from_message_to_message() -> None:
    steps = deliveries(fault("corrupt", field="wrench.force.x", change="bit_flip"))[10:20]
    bits = [step[0].edits[0].value for step in steps]
    assert len(set(bits)) > 5
    many = deliveries(fault("corrupt", field="wrench.force.x", change="bit_flip", duration=100.0), count=1000)[10:]
    assert {step[0].edits[0].value for step in many} == set(range(64)), "the sign, the highest bit, among them"


def test_faults_of_one_topic_apply_in_the_order_of_the_script() -> None:
    steps = deliveries(fault("duplicate"), fault("delay", delay=0.1))
    assert contents(steps)[10:12] == [[], [10, 10]]


faults = st.builds(
    Fault,
    at=st.floats(0.0, 3.0),
    duration=st.floats(0.0, 2.0),
    kind=st.sampled_from(MESSAGE_KINDS),
    topic=st.just("cmd_wrench"),
    probability=st.floats(0.0, 1.0),
    delay=st.floats(0.0, 1.0),
    jitter=st.floats(0.0, 1.0),
    offset=st.floats(-2.0, 2.0),
    field=st.just("wrench.force.x"),
    change=st.sampled_from(["nan", "inf", "huge", "bit_flip", "add"]),
)


@settings(max_examples=40)
@given(st.lists(faults, max_size=4).map(tuple), st.integers(0, 2**32 - 1))
def test_the_same_seed_makes_the_same_faults(chosen: tuple[Fault, ...], seed: int) -> None:
    assert repr(deliveries(*chosen, seed=seed)) == repr(deliveries(*chosen, seed=seed))


@given(st.lists(faults, max_size=4).map(tuple))
def test_no_message_is_delivered_before_it_was_sent_or_out_of_nothing(chosen: tuple[Fault, ...]) -> None:
    for number, step in enumerate(deliveries(*chosen)):
        assert all(d.number <= number and d.message <= d.number and d.due <= number * PERIOD for d in step)


def test_faults_do_not_depend_on_those_of_other_topics() -> None:
    dropped = Fault(at=0.0, kind="drop", topic="cmd_wrench", probability=0.5)
    other = Fault(at=0.0, kind="drop", topic="odom", probability=0.5)
    assert deliveries(dropped, other) == deliveries(dropped)


def test_different_seeds_make_different_faults() -> None:
    dropped = Fault(at=0.0, kind="drop", topic="cmd_wrench", probability=0.5)
    assert contents(deliveries(dropped, seed=1)) != contents(deliveries(dropped, seed=2))


def test_a_lost_position_leaves_heading_and_velocities() -> None:
    acting = Fault(at=1.0, duration=1.0, kind="lose_position", topic="odom")
    schedule = TopicSchedule(FaultScript((acting,), 1), "odom")
    edits = [{edit.field: edit.value for edit in schedule.take(n, n * PERIOD, n * PERIOD)[0].edits} for n in range(30)]
    assert edits[9] == edits[20] == {}
    assert set(edits[10]) == {"pose.pose.position.x", "pose.pose.position.y"}
    assert all(math.isnan(value) for value in edits[10].values())
