"""Every line of every panel: its values, times, roles and units, for a run whose quantities all differ."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vessel_hsmc_ros.core.metrics import Run, TrackErrors
from vessel_hsmc_ros.report import Record
from vessel_hsmc_ros.report.panels import panels
from vessel_hsmc_ros.report.record import Limit
from vessel_hsmc_ros.scenario.scenario import load_scenario

Array = NDArray[Any]

TERMS = (
    *(
        "surge_error",
        "sway_error",
        "surge_surface",
        "sway_surface",
        "yaw_surface",
        "heading_surface",
        "lyapunov",
        "lyapunov_rate",
    ),
    *(f"{axis}_{what}" for axis in ("surge", "sway", "yaw") for what in ("estimate", "weight_norm")),
    "compute_time",
)


def unlike_run() -> Run:
    """A run with noise, an observer and every term of the laws, in which no two columns are alike."""
    rng = np.random.default_rng(3)
    time: Array = 0.1 * np.arange(41)

    def columns(count: int, rows: int = 41) -> Array:
        return rng.normal(size=(rows, count))

    at = 0.05 + 0.2 * np.arange(20) + 1e-3 * rng.random(20)
    control = {name: rng.normal(size=20) for name in TERMS}
    control |= {"time": at, "commanded": columns(2, 20), "estimate": columns(6, 20)}
    return Run(time, columns(6), columns(6), columns(6), columns(2), columns(3), columns(3), control)


def turned(difference: Array) -> Array:
    """The shorter way round, in degrees."""
    return np.degrees(np.angle(np.exp(1j * difference)))


def distance(one: Array, other: Array) -> Array:
    return np.hypot(one[:, 0] - other[:, 0], one[:, 1] - other[:, 1])


def expected(run: Run, errors: TrackErrors) -> dict[str, tuple[str, list[tuple[str, Array, Array, str]]]]:
    """Units and lines by titles: name, times, values, role."""
    t, at, x, psi = run.time, run.control["time"], run.state - run.reference, run.state[:, 2]
    estimate, truth = run.control["estimate"], run.unforced_acceleration + run.disturbance
    # The newest state at the time of a control step.
    then = run.state[[int(np.flatnonzero(t <= instant)[-1]) for instant in at]]
    made: dict[str, tuple[str, list[tuple[str, Array, Array, str]]]] = {
        "position error": ("m", [("distance", t, np.hypot(x[:, 0], x[:, 1]), "main")]),
        "position error in the body frame": (
            "m",
            [
                ("forward", t, x[:, 0] * np.cos(psi) + x[:, 1] * np.sin(psi), "main"),
                ("to port", t, -x[:, 0] * np.sin(psi) + x[:, 1] * np.cos(psi), "other"),
            ],
        ),
        "heading error": ("°", [("heading error", t, turned(x[:, 2]), "main")]),
        "position, deviation from the truth": (
            "m",
            [
                ("measured", t, distance(run.measured, run.state), "measured"),
                ("estimate", at, distance(estimate, then), "main"),
            ],
        ),
        "heading, deviation from the truth": (
            "°",
            [
                ("measured", t, turned(run.measured[:, 2] - psi), "measured"),
                ("estimate", at, turned(estimate[:, 2] - then[:, 2]), "main"),
            ],
        ),
        "weight norms": ("", _terms(run, surge_weight_norm="surge", sway_weight_norm="sway", yaw_weight_norm="yaw")),
        "z_e of (11)": ("m", _terms(run, surge_error="z₁ₑ", sway_error="z₂ₑ")),
        "surge and sway surfaces": ("m/s", _terms(run, surge_surface="S₂ surge", sway_surface="σ₁ sway")),
        "yaw and heading surfaces": ("rad/s", _terms(run, yaw_surface="S₁ yaw", heading_surface="σ₂ heading")),
        "Lyapunov function": ("", _terms(run, lyapunov="V")),
        "Lyapunov function, time derivative": ("1/s", _terms(run, lyapunov_rate="dV/dt")),
        "computation time of the law": ("s", _terms(run, compute_time="law")),
        "control interval": ("s", [("interval", at[1:], np.diff(at), "main")]),
    }
    for name, values in (("cross-track", errors.cross), ("along-track", errors.along)):
        legs, turns = values.copy(), values.copy()
        legs[errors.turn], turns[~errors.turn] = np.nan, np.nan
        made[f"{name} error"] = ("m", [("on legs", t, legs, "main"), ("in turns", t, turns, "other")])
    for i, (title, scale, unit) in enumerate(
        (("surge velocity", 1.0, "m/s"), ("sway velocity", 1.0, "m/s"), ("yaw rate", 57.29577951308232, "°/s"))
    ):
        sources = (
            ("measured", t, run.measured, "measured"),
            ("ship", t, run.state, "main"),
            ("reference", t, run.reference, "desired"),
            ("estimate", at, estimate, "other"),
        )
        made[title] = (unit, [(name, when, scale * values[:, 3 + i], role) for name, when, values, role in sources])
    for i, (title, unit) in enumerate((("surge force", "N"), ("yaw moment", "N·m"))):
        applied, commanded = ("applied", t, run.wrench[:, i], "main"), ("commanded", at, run.control["commanded"][:, i], "other")
        made[title] = (unit, [applied, commanded])
    for i, (axis, of, unit) in enumerate((("surge", "f_u", "m/s²"), ("sway", "f_v", "m/s²"), ("yaw", "f_r", "rad/s²"))):
        learnt = _terms(run, **{f"{axis}_estimate": "estimate"})
        made[f"{axis} dynamics {of} and disturbance"] = (unit, [*learnt, ("truth", t, truth[:, i], "desired")])
        made[f"{axis} disturbance"] = (unit, [("disturbance", t, run.disturbance[:, i], "main")])
    return made


def _terms(run: Run, **names: str) -> list[tuple[str, Array, Array, str]]:
    roles = ("main", "other", "third")
    return [
        (label, run.control["time"], run.control[key], role) for (key, label), role in zip(names.items(), roles, strict=False)
    ]


@pytest.fixture
def made() -> tuple[Record, TrackErrors]:
    """A record of the run, whose errors against its plan are given."""
    rng = np.random.default_rng(4)
    errors = TrackErrors(np.arange(41) // 10, np.arange(41) % 10 > 6, rng.normal(size=41), rng.normal(size=41))
    changes = {"controller.law": "guided", "vessel_sim.actuators.surge_force_limit": 3e5}
    return Record("run", unlike_run(), scenario=load_scenario("case2_tracking", changes), track_errors=errors), errors


def test_every_line_shows_its_own_quantity(made: tuple[Record, TrackErrors]) -> None:
    record, errors = made
    wanted = expected(record.run, errors)
    found = {panel.title: panel for panel in panels(record)}
    assert found.keys() == wanted.keys()
    for title, (unit, lines) in wanted.items():
        panel = found[title]
        assert (panel.unit, panel.step) == (unit, panel.group == "Wrench"), title
        assert [(line.name, line.role) for line in panel.lines] == [(name, role) for name, _, _, role in lines], title
        for line, (name, time, values, _) in zip(panel.lines, lines, strict=True):
            np.testing.assert_array_equal(line.time, time, f"{title}, {name}")
            np.testing.assert_allclose(line.values, values, rtol=1e-9, atol=1e-12, err_msg=f"{title}, {name}")


def test_force_and_moment_have_limits_of_their_own(made: tuple[Record, TrackErrors]) -> None:
    found = {panel.title: panel.limits for panel in panels(made[0]) if panel.limits}
    assert found == {"surge force": (Limit(3e5, "actuator"), Limit(2e5, "law")), "yaw moment": (Limit(3e6, "law"),)}


def test_a_velocity_that_the_sensors_do_not_measure_has_no_line_of_zeros(made: tuple[Record, TrackErrors]) -> None:
    record, _ = made
    record.run.measured[:, 4] = 0.0
    found = {panel.title: [line.name for line in panel.lines] for panel in panels(record)}
    assert found["sway velocity"] == ["ship", "reference", "estimate"]
    assert found["surge velocity"] == found["yaw rate"] == ["measured", "ship", "reference", "estimate"]


def test_what_was_not_recorded_has_no_panel(made: tuple[Record, TrackErrors]) -> None:
    record, errors = made
    run = replace(record.run, reference=np.full((41, 6), np.nan), disturbance=np.full((41, 3), np.nan), measured=record.run.state)
    found = {panel.title: [line.name for line in panel.lines] for panel in panels(replace(record, run=run))}
    gone = {title for title in expected(record.run, errors) if title not in found}
    assert gone == {
        *("position error", "position error in the body frame", "heading error"),
        *("position, deviation from the truth", "heading, deviation from the truth"),
        *(f"{axis} disturbance" for axis in ("surge", "sway", "yaw")),
    }
    assert found["yaw rate"] == ["ship", "estimate"]
    assert found["yaw dynamics f_r and disturbance"] == ["estimate"]
