"""Paths that are planned in a thread: the reference goes on meanwhile, and joins the path without a jump."""

import math
import threading
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.core.exceptions import GoalError
from vessel_hsmc_ros.guidance import path_reference
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference
from vessel_hsmc_ros.guidance.path import plan_path
from vessel_hsmc_ros.nodes.helm import FIRST_LEAD, PathPlanning

PERIOD, DEADLINE = 0.05, 60.0
AHEAD, ASIDE = [(120.0, 0.0)], [(90.0, 60.0)]


class Sailing:
    """A reference under way on a path, the planning of another, and a gate before each plan."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, current: float = 0.0) -> None:
        parameters = ReferenceShipParameters(mode="path", initial_pose=(0.0, 0.0, 0.0))
        parameters = replace(parameters, motion=replace(parameters.motion, current=current))
        reference: Any = make_reference(parameters, PERIOD)
        reference.set_path(AHEAD)
        self.reference = reference
        self.planning, self.planned = PathPlanning(self.reference, PERIOD), threading.Semaphore(0)
        self.gate = threading.Semaphore(0)

        def gated(*args: Any) -> Any:
            assert self.gate.acquire(timeout=DEADLINE)
            try:
                return plan_path(*args)
            finally:
                self.planned.release()

        monkeypatch.setattr(path_reference, "plan_path", gated)
        self.states = [self.reference.state]

    def go_on(self, steps: int) -> list[Any]:
        """Advance as the node does; returns the paths that were taken."""
        taken = []
        for _ in range(steps):
            self.reference.advance()
            self.states.append(self.reference.state)
            if self.planning.due:
                taken.append(self.planning.take())
        return taken

    def finish_plan(self) -> None:
        """Let the present plan be made."""
        plan = self.planning._plan
        self.gate.release()
        assert self.planned.acquire(timeout=DEADLINE)
        with suppress(GoalError):
            plan.result(DEADLINE)  # type: ignore[union-attr]


@pytest.fixture
def sailing(monkeypatch: pytest.MonkeyPatch) -> Sailing:
    return Sailing(monkeypatch)


def test_a_plan_in_time_begins_at_its_step(sailing: Sailing) -> None:
    sailing.go_on(200)
    sailing.planning.start(ASIDE)
    sailing.finish_plan()
    assert sailing.go_on(round(FIRST_LEAD / PERIOD) - 1) == []
    assert sailing.go_on(1) == [ASIDE]
    assert not sailing.planning.busy


def test_the_reference_goes_on_until_a_late_plan_is_made_again_and_joins_it_without_a_jump(sailing: Sailing) -> None:
    sailing.go_on(300)
    sailing.planning.start(ASIDE)
    sailing.go_on(100)  # the plan takes five seconds, longer than it was given
    assert math.dist(sailing.states[-1][:2], sailing.states[-101][:2]) == pytest.approx(100 * PERIOD * 1.5, rel=1e-3)
    sailing.finish_plan()
    assert sailing.go_on(1) == [()]
    sailing.finish_plan()
    assert ASIDE in sailing.go_on(3000)
    states = np.array(sailing.states)
    assert np.abs(np.diff(states[:, 3:], axis=0)).max() < 0.02
    assert np.hypot(*np.diff(states[:, :2], axis=0).T).max() < 1.01 * PERIOD * np.hypot(*states[:, 3:5].T).max()
    assert states[-1, :2] == pytest.approx(ASIDE[0], abs=0.05)


def test_a_plan_that_takes_long_each_time_is_given_more_time_until_it_fits(sailing: Sailing) -> None:
    sailing.go_on(200)
    sailing.planning.start(ASIDE)
    taken = []
    for _ in range(4):
        assert sailing.go_on(50) == []  # each plan takes 2.5 s
        sailing.finish_plan()
        taken += sailing.go_on(1)
    assert taken == [(), (), ()]
    assert sailing.go_on(40) == [ASIDE]


def test_a_path_that_cannot_be_sailed_is_refused_and_the_present_one_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    sailing = Sailing(monkeypatch, current=1.4)  # no corner is slower than the current
    sailing.go_on(200)
    sailing.planning.start([(100.0, 0.0), (200.0, 0.0), (200.0, 20.0), (300.0, 20.0)])
    sailing.finish_plan()
    sailing.reference.advance()
    assert sailing.planning.due
    with pytest.raises(GoalError, match="corner"):
        sailing.planning.take()
    sailing.go_on(3000)
    assert sailing.states[-1][:2] == pytest.approx(AHEAD[0], abs=0.05)


def test_a_reset_discards_the_plan(sailing: Sailing) -> None:
    sailing.planning.start(ASIDE)
    sailing.planning.cancel()
    sailing.gate.release()
    assert sailing.planned.acquire(timeout=DEADLINE)
    assert sailing.go_on(100) == []
