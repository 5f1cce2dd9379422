"""The diagnostic tasks of the nodes: when each of them is OK, a warning, an error or stale."""

import math
import shutil
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.safety.monitors import Alarm, Bias
from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.nodes import controller_diagnostics, reporting
from vessel_hsmc_ros.nodes.controller_diagnostics import ControlDiagnostics, correlation_condition, monitors
from vessel_hsmc_ros.nodes.reporting import ERROR, OK, STALE, WARN, DiagnosticTask
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.parameter_groups import DiagnosticsParameters
from vessel_hsmc_ros.scenario.parameters import ControllerParameters

PERIOD = 10_000_000


def test_inputs_are_stale_where_one_was_never_received_or_is_too_old() -> None:
    assert reporting.ages("input age", {"odometry": 0.1, "reference": 0.4}, 0.5).level == OK
    late = reporting.ages("input age", {"odometry": 0.6, "reference": None}, 0.5)
    assert (late.level, late.message) == (STALE, "no recent odometry and reference")
    assert late.values["odometry"] == 0.6


@pytest.mark.parametrize(("recent", "level"), [(0, OK), (5, OK), (6, WARN), (300, WARN), (301, ERROR)])
def test_missed_deadlines_are_a_warning_from_some_a_minute_and_an_error_from_one_of_twenty(recent: int, level: bytes) -> None:
    assert reporting.counted("missed deadlines", 1000, recent, 6000, "missed periods").level == level


def test_events_of_more_than_a_minute_ago_are_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    recent, found = reporting.Recent(), []
    for now, count in ((0.0, 10), (30.0, 14), (61.0, 15), (91.0, 15)):  # noqa: B007
        found.append(recent.increase(count))
    assert found == [0, 4, 1, 0]


@pytest.mark.parametrize(("free", "level"), [(2e9, OK), (5e8, WARN), (5e7, ERROR)])
def test_a_disk_that_fills_is_a_warning_and_then_an_error(free: float, level: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=free))
    found = {c.name: c.level for c in reporting.recording(Path(), 0.0, 0)}
    assert found == {"queue": OK, "disk space": level, "gaps": OK}


def test_a_slow_recorder_and_lost_messages_are_warnings(tmp_path: Path) -> None:
    found = {c.name: c.level for c in reporting.recording(tmp_path, 5.5, 2)}
    assert (found["queue"], found["gaps"]) == (WARN, WARN)
    assert reporting.recording(tmp_path / "gone", 0.0, 0)[1].level == STALE


def test_a_reference_that_is_not_finite_is_an_error_and_a_refused_goal_a_warning() -> None:
    assert reporting.motion({"surge": 1.0}, "").level == OK
    assert reporting.motion({"surge": 1.0}, "goal refused").level == WARN
    assert reporting.motion({"surge": math.nan}, "").level == ERROR


@pytest.fixture
def health() -> ControlDiagnostics:
    return ControlDiagnostics(make_control_loop(ControllerParameters(law="guided")), lockstep=False)


def of(health: ControlDiagnostics, name: str, **limits: Any) -> DiagnosticTask:
    return next(c for c in health.diagnostic_tasks(DiagnosticsParameters(**limits)) if c.name == name)


def test_a_surface_or_a_weight_norm_above_its_limit_is_a_warning_that_names_it(health: ControlDiagnostics) -> None:
    health.stepped(Terms(yaw_surface=-3.0, surge_surface=1.0, sway_weight_norm=4.0))
    assert of(health, "surface magnitude").level == OK
    above = of(health, "surface magnitude", surface_limit=2.0)
    assert (above.level, above.message) == (WARN, "yaw above 2")
    assert of(health, "weight norm", weight_norm_limit=2.0).level == WARN
    assert of(health, "weight norm", weight_norm_limit=5.0).level == OK


def test_a_term_that_a_law_does_not_have_is_no_problem_and_an_infinite_one_is_an_error(health: ControlDiagnostics) -> None:
    health.stepped(Terms())
    assert of(health, "numerical health").level == OK
    assert of(health, "surface magnitude", surface_limit=1.0).message == "the law has none"
    health.stepped(Terms(surge_estimate=math.inf))
    assert of(health, "numerical health").message == "not finite: surge_estimate"


def test_a_control_period_that_scatters_by_more_than_half_is_a_warning(health: ControlDiagnostics) -> None:
    now = 0
    for k in range(100):
        now += PERIOD
        health.served(now + (2_000_000 if k % 2 else 0))
    assert of(health, "period").level == OK
    assert of(health, "period").values["deviation_max"] == pytest.approx(0.002)
    for k in range(100):
        now += PERIOD
        health.served(now + (6_000_000 if k % 8 == 0 else 0))
    assert of(health, "period").level == WARN


def test_a_saturated_law_is_stated_with_its_share(health: ControlDiagnostics) -> None:
    health.stepped(Terms())
    of(health, "saturation")  # the counting begins
    for k in range(10):
        health.stepped(Terms(surge_saturated=k < 3))
    assert of(health, "saturation") == DiagnosticTask("saturation", OK, "30% of the last minute at a limit", {"share": 0.3})


@pytest.mark.parametrize(
    ("surge", "yaw", "share"), [(4, 0, 0.4), (0, 4, 0.4), (4, 4, 0.4), (4, 7, 0.7), (10, 10, 1.0), (0, 0, 0.0)]
)
def test_a_period_with_any_part_of_the_command_at_its_limit_counts_once(
    health: ControlDiagnostics, surge: int, yaw: int, share: float
) -> None:
    health.stepped(Terms(surge_saturated=True, yaw_saturated=True))
    of(health, "saturation")  # the counting begins
    for k in range(10):
        health.stepped(Terms(surge_saturated=k < surge, yaw_saturated=k < yaw))
    assert of(health, "saturation").values == {"share": share}


def test_a_monitor_that_warns_is_a_warning_and_one_that_demands_the_safe_action_an_error() -> None:
    assert reporting.saturation(0.5, lasting=True).level == WARN
    assert monitors({Reason.NOT_MOVING: Alarm.OK, Reason.SATURATED: Alarm.OK}).level == OK
    assert monitors({Reason.NOT_MOVING: Alarm.OK, Reason.SATURATED: Alarm.WARN}).level == WARN
    found = monitors({Reason.NOT_MOVING: Alarm.SAFE, Reason.SATURATED: Alarm.OK})
    assert (found.level, found.message) == (ERROR, "the ship is driven and does not move")


def test_the_condition_of_a_covariance_does_not_depend_on_units_and_is_infinite_where_it_is_singular() -> None:
    covariance = np.array([[4.0, 1.0], [1.0, 1.0]])
    scaled = covariance * np.outer([1e6, 1.0], [1e6, 1.0])
    assert correlation_condition(scaled) == pytest.approx(correlation_condition(covariance))
    assert correlation_condition(covariance) == pytest.approx(3.0)
    assert correlation_condition(np.diag([1.0, 0.0])) == pytest.approx(1.0)
    assert correlation_condition(np.ones((2, 2))) > 1e12
    assert correlation_condition(np.diag([1.0, -1.0])) == math.inf
    assert correlation_condition(np.array([[math.nan]])) == math.inf


def test_a_compass_that_is_to_be_corrected_is_a_warning_with_its_angle() -> None:
    turned = controller_diagnostics.compass(Bias(-0.21, 0.017, lost=False))
    assert (turned.level, turned.message) == (WARN, "the compass reads 12 deg to the right, +-2 deg")
    for bias, level in (
        (Bias(0.05, 0.01, lost=False), OK),
        (Bias(0.3, 0.1, lost=False), OK),
        (Bias(0.0, math.inf, lost=True), WARN),
    ):
        assert controller_diagnostics.compass(bias).level == level
    assert controller_diagnostics.compass(None).level == OK
