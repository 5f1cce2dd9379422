"""Drawn sequences of goals, cancels, faults and resets, and what must hold of every answer to them."""

import random
from typing import Any

from vessel_hsmc_ros.core.exceptions import RefusalError
from vessel_hsmc_ros.guidance.tasks import Code, Done, Goal, Limits, Order, Output, Report, Sail, Sight, Tasks

FAULTS = ("controller in standby: IN_STANDBY", "controller in stopped: IN_STOP", "controller silent")
SAFE_REASONS = ("OVERDUE, not received", "NOT_MOVING, driven and does not move")
BLOCKS = ("battery", "operator")
STANDING = (Order.HOLD, Order.STOP, Order.RETURN)


class Sequence:
    """A vessel whose goals are drawn, and a record of them kept apart from `Tasks`.

    Attributes:
        results: Codes of the results, in their order.
    """

    def __init__(self, seed: int) -> None:
        self._draw = random.Random(seed)  # noqa: S311
        draw = self._draw
        self._limits = Limits(
            draw.choice((0.5, 5.0)), draw.choice((0.4, 10.0)), draw.choice((0.0, 3.0)), draw.choice(("hold", "stop", "return"))
        )
        self._tasks = Tasks(self._limits)
        self._open: dict[Any, Goal] = {}
        self._closed: list[Goal] = []
        self._sailing: Goal | None = None
        self._asked: Goal | None = None  # the goal whose way is planned
        self._time, self._fault, self._safe, self._held = 0.0, "", "", False
        self._safe_for = self._blind_for = -1.0  # ticks in which they lasted since the goal is sailed, s
        self._blocked: set[str] = set()
        self._arrived = False
        self.results: list[Code] = []

    def run(self, events: int) -> None:
        """Draw events, and check every answer."""
        moves = (
            self._offer,
            self._cancel,
            self._plan,
            *[self._tick] * 8,
            *[self._offer, self._plan] * 2,
            self._controller,
            self._block,
            self._hold,
            self._other,
        )
        for _ in range(events):
            self._draw.choice(moves)()
            assert self._tasks.active == self._sailing
            assert set(self._open.values()) == {goal for goal in (self._tasks.active, self._tasks.candidate) if goal}
        self._note(self._tasks.reset("the reference ship has ended"))
        assert not self._open, "every accepted goal has a result"

    def _note(self, outputs: list[Output]) -> list[Output]:
        """Record an answer, and check what holds of all of them."""
        for output in outputs:
            if isinstance(output, Done):
                assert output.text
                assert output.goal.key in self._open, "one result, of a goal that has none"
                self._closed.append(self._open.pop(output.goal.key))
                self._sailing = None if output.goal == self._sailing else self._sailing
                self.results.append(output.code)
            elif isinstance(output, Report):
                assert output.goal == self._sailing, "no feedback but of the goal that is sailed"
            elif isinstance(output, Sail):
                assert output.goal.key in self._open
                self._asked = output.goal
        return outputs

    def _done(self, outputs: list[Output]) -> dict[Any, Done]:
        return {output.goal.key: output for output in outputs if isinstance(output, Done)}

    def _offer(self) -> None:
        if self._closed and self._draw.random() < 0.1:
            assert self._tasks.cancel(self._draw.choice(self._closed)) == []
        goal = Goal(self._draw.getrandbits(64), self._draw.random() < 0.5)
        refusal = "path of 0 poses" if self._draw.random() < 0.1 else ""
        before = dict(self._open)
        self._open[goal.key] = goal
        done = self._done(self._note(self._tasks.offer(goal, refusal)))
        if refusal or self._fault or self._blocked or self._held:
            assert done.keys() == {goal.key}, "a goal that is refused leaves the others alone"
            assert done[goal.key].code is Code.REFUSED
            assert (refusal or self._fault or "") in done[goal.key].text or self._blocked or self._held
        else:
            assert {one.code for one in done.values()} <= {Code.PREEMPTED}
            assert goal.key in self._open
            assert self._asked == goal
            assert done.keys() <= before.keys()

    def _cancel(self) -> None:
        if not self._open:
            return
        goal, sailed = self._draw.choice(list(self._open.values())), self._sailing
        outputs = self._note(self._tasks.cancel(goal))
        assert self._done(outputs)[goal.key].code is Code.CANCELLED, "a cancel is always answered"
        assert (Order.HOLD in outputs) == (goal == sailed)
        assert self._tasks.cancel(goal) == []

    def _plan(self) -> None:
        goal = self._asked
        if goal is None:
            return
        self._asked, is_open, before = None, goal.key in self._open, self._sailing
        if self._draw.random() < 0.3:
            done = self._done(self._note(self._tasks.failed(goal, "corner 2 has no room")))
            assert {key: one.code for key, one in done.items()} == ({goal.key: Code.REFUSED} if is_open else {})
            return
        outputs = self._tasks.sailed(goal)
        self._sailing = goal if is_open else self._sailing
        done = self._done(self._note(outputs))
        if is_open:
            self._safe_for = self._blind_for = -1.0
            assert {key: one.code for key, one in done.items()} == ({before.key: Code.PREEMPTED} if before else {})
            self._sailing = goal

    def _tick(self) -> None:
        step = self._draw.choice((0.125, 0.5, 2.0))  # exact in binary
        self._time += step
        self._arrived ^= self._draw.random() < 0.25
        distance = None if self._draw.random() < 0.2 else self._draw.choice((0.1, 1.0, 4.0, 20.0))
        sight, sailed = Sight(self._time, distance, self._arrived), self._sailing
        outputs = self._note(self._tasks.tick(sight))
        if sailed is None:
            assert outputs == []
            return
        self._safe_for = (0.0 if self._safe_for < 0.0 else self._safe_for + step) if self._safe else -1.0
        # The reason of the safe action comes first.
        lost = self._safe if self._safe_for > self._limits.tolerance else ""
        if not lost:
            self._blind_for = (0.0 if self._blind_for < 0.0 else self._blind_for + step) if distance is None else -1.0
            lost = "no odometry" if self._blind_for > self._limits.tolerance else ""
        done = self._done(outputs)
        if lost:
            assert done[sailed.key].code is Code.CONTROLLER, "a fault that lasts ends a goal"
            assert lost in done[sailed.key].text
            assert Order.HOLD in outputs
            assert not self._open
        elif done:
            assert done.keys() == {sailed.key}
            code = done[sailed.key].code
            assert sight.arrived
            assert not self._held
            assert distance is not None
            assert (code is Code.REACHED) == (distance <= self._limits.reach)
            assert code in (Code.REACHED, Code.NOT_REACHED)
        else:
            assert outputs == [Report(sailed)]
            assert self._held or distance is None or not sight.arrived or distance > self._limits.reach

    def _controller(self) -> None:
        self._fault = self._draw.choice(FAULTS) if self._draw.random() < 0.3 else ""
        self._safe = self._draw.choice(SAFE_REASONS) if not self._fault and self._draw.random() < 0.4 else ""
        self._safe_for = self._safe_for if self._safe else -1.0
        before = dict(self._open)
        outputs = self._note(self._tasks.controller(self._fault, self._safe))
        done = self._done(outputs)
        assert done.keys() == (before.keys() if self._fault else set()), "a fault always ends the goals"
        assert all(one.code is Code.CONTROLLER and self._fault in one.text for one in done.values())
        assert (Order.HOLD in outputs) == bool(done)

    def _block(self) -> None:
        name = self._draw.choice(BLOCKS)
        if self._draw.random() < 0.6:
            self._tasks.unblock(name)
            self._blocked.discard(name)
            return
        before, again = dict(self._open), name in self._blocked
        outputs = self._note(self._tasks.block(name, f"{name} low", self._limits.at_end))
        self._blocked.add(name)
        if again:
            assert outputs == []
            return
        self._held = False
        done = self._done(outputs)
        assert done.keys() == before.keys()
        assert all(one.code is Code.ENDED and f"{name} low" in one.text for one in done.values())
        assert outputs[-1] in STANDING

    def _hold(self) -> None:
        if self._draw.random() < 0.4:
            assert self._tasks.hold() == [Order.HOLD]
            self._held = True
            return
        try:
            assert self._tasks.go_on() == [Order.GO_ON]
        except RefusalError:
            assert not self._held
        else:
            assert self._held
            self._blind_for = -1.0
        self._held = False

    def _other(self) -> None:
        """A message of another program, or a reset."""
        before, what = dict(self._open), self._draw.choice(("reset", "topic"))
        if what == "reset":
            done, code = self._done(self._note(self._tasks.reset("the reference was reset"))), Code.RESET
            self._held = False
        elif self._blocked or self._held:  # the node refuses such a message
            return
        else:
            done, code = self._done(self._note(self._tasks.displaced("a path on the topic path"))), Code.PREEMPTED
        assert {key: one.code for key, one in done.items()} == dict.fromkeys(before, code)
