"""Random sequences of messages, law values and operator commands through the controller's own code, and what holds in all."""

import inspect
import random
import sys
import textwrap
from collections.abc import Iterable, Iterator
from typing import Any

import pytest
from durations import rest_long
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_sequences import drive

from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.control.safety.samples import Freshness
from vessel_hsmc_ros.control.safety.supervision import Supervision
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.controller_inputs import ControllerInputs, InputMonitor
from vessel_hsmc_ros.nodes.controller_timing import RealTime


@settings(max_examples=250)
@given(st.binary(min_size=21, max_size=81))
def test_every_sequence_of_messages_gives_finite_bounded_commands_and_leads_back_to_the_law(data: bytes) -> None:
    drive(data)


def fixed_sequences(count: int) -> Iterator[bytes]:
    """Sequences that are the same in every run."""
    for seed in range(count):
        source = random.Random(seed)  # noqa: S311 - no secret
        yield source.randbytes(source.randrange(41, 82))


def drive_all(sequences: Iterable[bytes]) -> None:
    for data in sequences:
        drive(data)


def test_the_sequences_reach_every_reason_of_a_refusal() -> None:
    refused = {reason for data in fixed_sequences(60) for reason in drive(data).refused}
    assert refused == {
        Reason.STAMP_OLD,
        Reason.STAMP_FUTURE,
        Reason.DUPLICATE,
        Reason.OUT_OF_ORDER,
        Reason.WRONG_FRAME,
        Reason.NOT_FINITE,
        Reason.UNCERTAIN,
    }


PLANTED = [
    (ControllerInputs.reset, "self._jumps.reset()", "pass"),
    (ControllerInputs.reset, "self.monitor.reset()", "pass"),
    (ControllerInputs.take_odometry, "self._loop.supervision.handover()", "pass"),
    (ControllerInputs.take_odometry, "if verdict is Verdict.HOLD:", "if False:"),
    (ControllerInputs.take_odometry, "return False", "pass"),
    (ControllerInputs.take_reference, "desired.wrong):", "desired.wrong) or True:"),
    (ControllerInputs.serve, " or self._held_out(now)", ""),
    (ControllerInputs.serve, "self.monitor.overdue(now, received_now)", "None"),
    (RealTime.ready, "if min(", "if max("),
    (RealTime.ready, "return missing[1]", "pass"),
    (RealTime._watch_clock, "self._node.loop.forget()", "pass"),
    (RealTime._watch_clock, "elif step > CLOCK_STEP", "elif step > 100 * CLOCK_STEP"),
    (RealTime._stepped, "node.inputs.reset(reason)", "pass"),
    (ControllerNode.halt, "self._steps.stopped()", "pass"),
    (ControllerNode.halt, "self.loop.wrench = NO_WRENCH", "pass"),
    (ControllerNode.publish_command, "if self._zeros >= LAST_COMMANDS:", "if False:"),
    (ControllerNode.begin, "self._steps.ready()", "Reason.NONE"),
    (InputMonitor.take, "self.fresh[name] = 0", "pass"),
    (InputMonitor.overdue, "if reason := freshness.overdue(now, received_now):", "if reason := Reason.NONE:"),
    (Freshness._check, "sample.stamp <= self.last", "sample.stamp == self.last"),
    (Freshness._check, "if not sample.covariance <= self", "if sample.covariance > self"),
    (Freshness._check_stamp, "stamp < now - self.timeout", "stamp < now - 2 * self.timeout"),
    (Supervision.activate, "self.handover()", "pass"),
    (Supervision.handover, "self._handing_over, self._follows_own = 0.0, False", "pass"),
    (Supervision._recover, "self._good + 1", "self.parameters.fresh_samples"),
    (Supervision._enter, "self._elapsed, self._good = 0.0, 0", "self._good = 0"),
    (Supervision.standby, "if self.operation is Operation.STOPPED:", "if False:"),
]


@pytest.mark.parametrize(
    ("function", "find", "replace"), rest_long(PLANTED, 3), ids=[f"{f.__qualname__}: {r} for {t}" for f, t, r in PLANTED]
)
def test_the_oracle_notices_a_planted_bug(monkeypatch: pytest.MonkeyPatch, function: Any, find: str, replace: str) -> None:
    text = textwrap.dedent(inspect.getsource(function))
    assert text.count(find) == 1
    scope: dict[str, Any] = {}
    module = sys.modules[function.__module__]
    exec(text.replace(find, replace), vars(module), scope)  # noqa: S102 - our own source
    monkeypatch.setattr(getattr(module, function.__qualname__.partition(".")[0]), function.__name__, scope[function.__name__])
    with pytest.raises(AssertionError):
        drive_all(fixed_sequences(400))
