"""What studies of a ship and runs of a fleet state, from motions and results of unlike values."""

import math
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from records import make_run

from vessel_hsmc_ros.control.loop.linearised_law import Margins
from vessel_hsmc_ros.core.exceptions import BagError, RunError
from vessel_hsmc_ros.guidance.curve_motion import Demand
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import load_scenario, make_fleet
from vessel_hsmc_ros.studies import margins, scenario_run
from vessel_hsmc_ros.studies.forecast import feasibility
from vessel_hsmc_ros.studies.manoeuvres.run import in_still_water
from vessel_hsmc_ros.studies.margins import Need

RATE = margins.RATE_HZ


def test_what_an_input_needs_is_that_of_its_course_after_the_start() -> None:
    omega, count = 0.5, 4000
    time = np.arange(count) / RATE
    course = 30.0 - 10.0 * np.cos(omega * time)
    course[: count // 4] = np.linspace(-90.0, -70.0, count // 4)
    found = margins._need(course, 200.0)
    assert found.size == pytest.approx(90.0, rel=0.02)
    assert found.rate == pytest.approx(10.0 * omega, rel=0.01)
    assert found.frequency == pytest.approx(omega, rel=0.05)
    assert margins._need(course, 1000.0).frequency == 0.0  # it varies by less than a fiftieth of the limit
    falling = np.concatenate([np.zeros(300), -(np.arange(700) ** 2) / 100.0])
    assert margins._need(falling, 1e9).rate == pytest.approx(14.0 * RATE, rel=0.02)


def test_the_moment_of_a_coupled_hull_moves_its_sway_too() -> None:
    scenario = in_still_water("otter", {"vessel": "otter"})
    ship = scenario.vessel_sim.vessel.coefficients()
    assert ship.m32
    motion = np.zeros((400, 9))
    motion[:, 7] = 0.5  # dv, at rest
    surge, yaw = margins._needs(scenario, motion)
    assert surge.size == 0.0
    assert yaw.size == pytest.approx(abs(ship.m32) * 0.5)


def test_actuators_have_their_own_lags_and_dead_times() -> None:
    names = ("surge_lag", "yaw_lag", "surge_dead_time", "yaw_dead_time")
    changes = {f"vessel_sim.actuators.{name}": value for name, value in zip(names, (0.5, 1.5, 0.25, 0.75), strict=True)}
    known = {f"controller.vessel.{name}": value for name, value in zip(names, (2.5, 3.5, 1.25, 1.75), strict=True)}
    scenario = load_scenario("case2_tracking", {**changes, **known})
    assert margins._actuators(scenario) == ((0.5, 1.5), (0.25, 0.75))
    by_thrusters: Any = SimpleNamespace(
        vessel_sim=SimpleNamespace(actuators=SimpleNamespace(kind="thrusters")), controller=scenario.controller
    )
    assert margins._actuators(by_thrusters) == ((2.5, 3.5), (1.25, 1.75))


def test_each_shortcoming_names_its_loop_its_need_and_its_limit() -> None:
    limits = {"surge_force_limit": 100.0, "yaw_moment_limit": 2000.0, "surge_force_rate": 30.0, "yaw_moment_rate": 500.0}
    scenario = load_scenario("case2_tracking", {f"controller.vessel.{name}": value for name, value in limits.items()})
    loops = {
        "surge force": Margins(True, 5.5, 60.5, 1.0, 0.25),
        "yaw moment": Margins(True, 9.5, 30.5, 1.0, 0.75),
        "position across": Margins(False, 1.0, 1.0, 1.0, 0.5),
        "fine": Margins(True, 6.5, 40.5, 1.0, 0.5),
    }
    found = margins.Study(2.0, loops, Need(150.0, 20.0, 0.5), Need(1500.0, 700.0, 1.25))
    should, slow = "it should have 6 dB and 40° at least", "the ship is too slow for the reference: it needs"
    assert margins.shortcomings(scenario, found) == [
        f"the loop of the surge force has margins of 5.5 dB and 60.5°; {should}",
        f"the loop of the yaw moment has margins of 9.5 dB and 30.5°; {should}",
        "the loop of the position across is unstable",
        f"{slow} a surge force of 150 N, but the limit is 100 N",
        f"{slow} a surge force that varies at 0.5 rad/s on average, but the loop follows up to 0.25 rad/s",
        f"{slow} a yaw moment that changes by 700 N·m in a second, but it is limited to 500 N·m",
        f"{slow} a yaw moment that varies at 1.2 rad/s on average, but the loop follows up to 0.75 rad/s",
    ]
    enough = margins.Study(2.0, {**loops, "surge force": loops["fine"]}, Need(50.0, 35.0, 0.25), Need(2500.0, 400.0, 0.5))
    assert margins.shortcomings(scenario, enough)[2:] == [
        f"{slow} a surge force that changes by 35 N in a second, but it is limited to 30 N",
        f"{slow} a yaw moment of 2.5 kN·m, but the limit is 2 kN·m",
    ]


def test_a_ship_is_checked_by_the_ends_of_its_own_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    time = np.arange(101.0)
    last, quarter = time >= 90.0, time >= 75.0

    def moving(u: float, v: float, r: float) -> Any:
        state = np.full((101, 6), 9.0)
        state[last, 3:] = u, v, r
        return make_run(time, state)

    reference = np.zeros((101, 6))
    tracked = np.zeros((101, 6))
    tracked[:, 0] = np.where(quarter, np.where(time == 80.0, -0.5, 0.1), 30.0)
    limits = {"controller.vessel.surge_force_limit": 50.0, "controller.vessel.yaw_moment_limit": 400.0}
    scenario = load_scenario("case2_tracking", {**limits, "vessel.length": 20.0, "vessel_sim.sensors.position_noise": 0.5})
    moments: list[float] = []

    def steady(_: Any, scale: Any, moment: float) -> Any:
        assert (scale.F, scale.N) == (50.0, 400.0)
        moments.append(moment)
        return moving(1.5, -2.0, -0.125) if moment else moving(3.0, 4.0, 0.0)

    monkeypatch.setattr(feasibility, "steady", steady)
    monkeypatch.setattr("vessel_hsmc_ros.guidance.curve_motion.demand", lambda *_: Demand(0.1, 20.0, 100.0))
    monkeypatch.setattr(feasibility, "simulate", lambda _: make_run(time, tracked, reference=reference))
    found = feasibility.check_ship(scenario)
    assert moments == [0.0, 400.0]
    expected = {
        "speed": 5.0,
        "turn_rate": -0.125,
        "turn_diameter": 2.0 * 2.5 / 0.125,
        "surge_share": 0.4,
        "yaw_share": 0.25,
        "error": 0.5,
        "error_lengths": 0.025,
        "duration": 100.0,
        "noise": 0.025,
        "fastest": scenario.vessel_sim.vessel.surge_speed_range[1],
    }
    assert {name: getattr(found, name) for name in expected} == pytest.approx(expected)
    assert found._replace(error_lengths=0.074).tracked  # within three standard deviations of the noise
    assert not found._replace(error_lengths=0.076).tracked
    lines = feasibility.verdict(found._replace(fastest=4.5))
    assert lines == [
        "full surge force: 5 m/s, beyond 4.5 m/s, up to which its hull data hold; with the full yaw moment a turning circle of"
        " 40 m at -7.16°/s",
        "the circle needs 40 % of the surge force, 25 % of the yaw moment and a drift angle of 5.7° in calm water",
        "follows its circle: position error at most 0.5 m, 1 of the 0.5 m of noise of its positions,"
        " in the last quarter of 100 s",
    ]
    assert math.isinf(found.fastest) or found.fastest > 0.0


@pytest.fixture
def ended(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """How the processes of a fleet end, and what is evaluated afterwards."""
    how: dict[str, Any] = {"code": 0, "failure": "", "error": None, "evaluated": 0, "summaries": []}

    def evaluate(*_: Any) -> None:
        how["evaluated"] += 1
        if how["error"]:
            raise how["error"]

    def write_summary(_: Any, _origin: Any, code: int, failure: str, content: Any) -> None:
        how["summaries"].append((code, failure, content))

    def supervise(*_: Any, vessels: Any) -> Any:
        how.update(vessels=vessels)
        return SimpleNamespace(code=how["code"], failure=how["failure"])

    monkeypatch.setattr(scenario_run, "supervisor_module", lambda: SimpleNamespace(supervise=supervise))
    monkeypatch.setattr(scenario_run, "_evaluate_fleet", evaluate)
    monkeypatch.setattr(scenario_run, "write_summary", write_summary)
    return how


FLEET = make_fleet(load_scenario("case2_straight"), 3, "boat")


@pytest.mark.parametrize(
    ("code", "failure", "error", "expected"),
    [
        (0, "", None, (0, "")),
        (1, "boat_2/controller failed", None, (1, "boat_2/controller failed")),
        (130, "interrupted", None, (130, "interrupted")),
        (0, "", BagError("the disk is full"), (1, "the disk is full")),
    ],
)
def test_a_fleet_has_the_exit_code_and_the_failure_of_its_processes_else_of_its_evaluation(
    ended: dict[str, Any], tmp_path: Path, code: int, failure: str, error: Exception | None, expected: tuple[int, str]
) -> None:
    ended.update(code=code, failure=failure, error=error)
    result = scenario_run.run_fleet(FLEET, RunFolder(tmp_path), lambda _: None)
    assert (result.exit_code, result.failure) == expected
    assert ended["vessels"] == ("boat_1", "boat_2", "boat_3")
    assert ended["evaluated"] == (0 if failure else 1)
    assert ended["summaries"][-1][:2] == expected
    assert "boat_3" in (tmp_path / "params.yaml").read_text()


def test_a_summary_that_cannot_be_written_hides_no_interrupt(
    ended: dict[str, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def refused(*_: Any) -> None:
        raise RunError("the disk is full")

    ended.update(code=130, failure="interrupted")
    monkeypatch.setattr(scenario_run, "write_summary", refused)
    result = scenario_run.run_fleet(FLEET, RunFolder(tmp_path), lambda _: None)
    assert (result.exit_code, result.failure) == (130, "interrupted")


def test_the_summary_of_a_fleet_has_each_vessel_under_its_name(ended: dict[str, Any], tmp_path: Path) -> None:
    metrics: Any = SimpleNamespace(_asdict=lambda: {"a": 1.5})
    records: Any = [
        SimpleNamespace(name="boat_1", metrics=metrics, facts={"messages_recorded": 3}),
        SimpleNamespace(name="boat_2", metrics=None, facts={"messages_recorded": 4}),
    ]
    result = scenario_run.Result(RunFolder(tmp_path), 1, "failed", facts={"vessels": scenario_run.by_vessel(records)})
    scenario_run.write_results(result, {})
    assert ended["summaries"] == [
        (
            1,
            "failed",
            {
                "metrics": None,
                "vessels": {
                    "boat_1": {"metrics": {"a": 1.5}, "messages_recorded": 3},
                    "boat_2": {"metrics": None, "messages_recorded": 4},
                },
            },
        )
    ]


@pytest.mark.parametrize("lockstep", [True, False])
def test_a_fleet_reserves_each_namespace_and_the_clock_once(monkeypatch: pytest.MonkeyPatch, lockstep: bool) -> None:
    held: list[tuple[str, bool]] = []

    @contextmanager
    def reserve(namespace: str, clock: bool) -> Any:
        held.append((namespace, clock))
        yield
        held.remove((namespace, clock))

    monkeypatch.setattr(scenario_run, "reserve_namespace", reserve)
    given: Any = SimpleNamespace(vessels=FLEET.vessels, lockstep=lockstep)
    with scenario_run.reserve_namespaces(given):
        assert held == [("boat_1", lockstep), ("boat_2", False), ("boat_3", False)]
    assert held == []
