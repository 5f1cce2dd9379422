"""The wait for a fleet, with nodes and a clock of which each state is given."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from vessel_hsmc_ros.nodes.runs import supervisor
from vessel_hsmc_ros.nodes.runs.processes import spread
from vessel_hsmc_ros.nodes.runs.supervisor import CONNECT_LIMIT, CONNECT_LIMIT_PER_VESSEL, ExitStatus, Watched, not_discovered

PROCESSES = spread(("one", "two"), by_thrusters=False, lockstep=True)


@pytest.fixture
def wait(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[ExitStatus, list[float]]]:
    """Waits for plants that report simulated times turn by turn, some seconds apart, and then end in order."""

    def call(*times: dict[str, float], apart: float) -> tuple[ExitStatus, list[float]]:
        now, turns, reached = 0.0, iter(times), list[float]()
        plants = [
            SimpleNamespace(name=name, code=None, popen=SimpleNamespace(poll=lambda: None))
            for name in PROCESSES
            if name.endswith("vessel_sim")
        ]
        listener = SimpleNamespace(status={}, heard_at={})

        def listen(_: float) -> None:
            nonlocal now
            now += apart
            turn = next(turns, None)
            if turn is None:
                for plant in plants:
                    plant.code, plant.popen = 0, SimpleNamespace(poll=lambda: 0)
            else:
                listener.status = {f"{vessel}/vessel_sim": {"simulated_time": str(time)} for vessel, time in turn.items()}
                listener.heard_at |= dict.fromkeys(listener.status, now)

        listener.listen = listen
        monkeypatch.setattr(supervisor, "time", SimpleNamespace(monotonic=lambda: now))
        nodes: Any = SimpleNamespace(processes=plants)
        relay: Any = SimpleNamespace(processes=[])
        faults: Any = SimpleNamespace(affected=set())
        interrupts: Any = SimpleNamespace(status=lambda: None)
        given: Any = listener
        watched = Watched(PROCESSES, nodes, relay, given, faults)
        return supervisor._monitor(watched, interrupts, reached.append), reached

    return call


def test_the_progress_of_a_fleet_is_that_of_its_slowest_vessel(wait: Callable[..., tuple[ExitStatus, list[float]]]) -> None:
    assert wait({"one": 3.0}, {"one": 5.0, "two": 1.0}, {"one": 6.0, "two": 7.0}, apart=0.1) == (ExitStatus(0), [1.0, 6.0])


def test_a_fleet_of_which_one_vessel_does_not_start_is_ended(wait: Callable[..., tuple[ExitStatus, list[float]]]) -> None:
    limit = CONNECT_LIMIT + 2 * CONNECT_LIMIT_PER_VESSEL
    late = {"one": 3.0}
    assert wait(late, late, late, late, apart=0.4 * limit) == (not_discovered(limit), [])
    assert wait(late, late, late, apart=0.4 * limit) == (ExitStatus(0), [])


def test_the_time_for_discovery_counts_from_the_last_node_that_has_started(
    wait: Callable[..., tuple[ExitStatus, list[float]]],
) -> None:
    limit = CONNECT_LIMIT + 2 * CONNECT_LIMIT_PER_VESSEL
    one, both = {"one": 0.0}, {"one": 0.0, "two": 0.0}
    moving = {"one": 3.0, "two": 1.0}
    assert wait(one, one, both, both, moving, apart=0.4 * limit) == (ExitStatus(0), [1.0])
    assert wait(one, one, both, both, both, both, moving, apart=0.4 * limit) == (not_discovered(limit), [])
