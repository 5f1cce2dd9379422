"""The plant in lockstep, where commands are missing or refused and the run goes on."""

import math
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from driving import Helm, command

from vessel_hsmc_ros.nodes.commands import nothing
from vessel_sim_node.node import VesselSimNode


@pytest.fixture
def helm(bench: Any) -> Any:
    return Helm(bench)


class Gaps:
    """A plant at 1 Hz that rides through missing commands, with a time-out of 3 s; the wrench that answers each step."""

    PERIOD = 1_000_000_000

    def __init__(self, bench: Any, helm: Any) -> None:
        self.bench, self.helm = bench, helm
        self.node = bench.start(VesselSimNode, rate_hz=1.0, command_timeout=3.0, ride_through=True)
        self.step = 0

    def answer(self, force: float | None, **others: Any) -> float:
        """The applied force of the next step, answered by a command, or by the message that there is none."""
        self.bench.until(lambda: len(self.helm.odometry) == self.step + 1)
        stamp = self.step * self.PERIOD
        if force is None:
            self.helm.commands.publish(nothing(stamp))
        else:
            self.helm.command(stamp, force, **others)
        self.step += 1
        self.bench.until(lambda: len(self.helm.applied) == self.step)
        return float(self.helm.applied[-1].wrench.force.x)


def test_a_plant_that_rides_through_holds_a_command_for_the_timeout_in_simulated_time(bench: Any, helm: Any) -> None:
    gaps = Gaps(bench, helm)
    assert [gaps.answer(force) for force in (1e5, None, None, None, None, None, 2e5)] == [1e5, 1e5, 1e5, 1e5, 0.0, 0.0, 2e5]


def test_a_plant_that_rides_through_takes_a_delayed_command_when_it_comes(bench: Any, helm: Any) -> None:
    gaps = Gaps(bench, helm)
    assert [gaps.answer(1e5), gaps.answer(None)] == [1e5, 1e5]
    helm.command(gaps.PERIOD, 3e5)
    assert gaps.answer(None) == 3e5
    helm.command(0, 7e5)  # older than the last one
    assert gaps.answer(None) == 3e5


@pytest.mark.parametrize("change", [{"force": math.nan}, {"force": 7e5, "frame": "map"}])
def test_a_plant_that_rides_through_refuses_what_a_plant_in_real_time_refuses(bench: Any, helm: Any, change: Any) -> None:
    gaps = Gaps(bench, helm)
    assert [gaps.answer(1e5), gaps.answer(**change), gaps.answer(2e5)] == [1e5, 1e5, 2e5]
    assert command(gaps.node).values["refused"] == 1


def test_a_lockstep_run_without_faults_has_no_concern(bench: Any, helm: Any) -> None:
    gaps = Gaps(bench, helm)
    for _ in range(3):
        gaps.answer(1e5)
        assert {task.level for task in gaps.node.diagnostic_tasks()} == {DiagnosticStatus.OK}
