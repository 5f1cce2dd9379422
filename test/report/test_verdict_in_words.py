"""The verdict on a run in words."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from records import make_run

from vessel_hsmc_ros.core.quantities import number, quantity
from vessel_hsmc_ros.report import Record
from vessel_hsmc_ros.report.record import measured, with_verdict
from vessel_hsmc_ros.scenario.scenario import load_scenario

Array = NDArray[Any]
GUIDED = {"controller.law": "guided"}


def judged(
    error: Callable[[Array], Array],
    force: Callable[[Array], Array] = np.zeros_like,
    *,
    duration: float = 200.0,
    speed: float = 2.0,
    changes: dict[str, object] | None = None,
    plant: bool = True,
    **known: Any,
) -> str:
    """The verdict on a ship that lags its straight reference by an error, with a surge force; both are functions of the time."""
    time = np.arange(0.0, duration, 0.05)
    zero = np.zeros_like(time)
    reference = np.column_stack([speed * time, zero, zero, zero + speed, zero, zero])
    state = reference - np.column_stack([error(time), *[zero] * 5])
    run = make_run(time, state, reference=reference, wrench=np.column_stack([force(time), zero]))
    run = replace(run, unforced_acceleration=np.full((len(time), 3), 0.0 if plant else np.nan))
    scenario = load_scenario("case2_tracking", {**GUIDED, **(changes or {})})
    return with_verdict(Record("run", run, measured(run, scenario), scenario=scenario, **known)).verdict


def test_a_run_that_converges_tracks_the_reference_from_its_settling_time_on() -> None:
    assert judged(lambda t: np.maximum(10.0 * np.exp(-t / 5.0), 0.003)) == (
        "The ship tracks the reference: the position error is 3 mm rms in the last quarter, at most 3 mm,"
        " and below 0.5 m after 15 s."
    )


def test_an_error_below_a_micrometre_is_not_given_as_a_number() -> None:
    text = judged(lambda t: np.maximum(10.0 * np.exp(-t / 2.0), 5e-9))
    assert "the position error is less than 1 µm rms in the last quarter, at most less than 1 µm, and below" in text


def test_a_run_that_drifts_away_does_not_track_and_its_error_grows() -> None:
    assert judged(lambda t: 0.1 * t) == (
        "The ship does not track the reference: the position error is 17.6 m rms in the last quarter, at most 20 m,"
        " and grows by 9.99 m in the second half of the run."
    )


@pytest.mark.parametrize(
    ("error", "trend"),
    [
        (lambda t: 50.0 * np.exp(-t / 100.0), "still decreases by 11.4 m in the second half of the run"),
        (lambda t: 2.8 + 0.007 * t, "grows by 0.7 m in the second half of the run"),
        (lambda t: 5.0 + np.sin(2.0 * np.pi * t / 50.0), "neither grows nor decreases"),
        (lambda t: 5.0 + 0.0 * t, "neither grows nor decreases"),
        (
            lambda t: np.maximum(100.0 * np.exp(-t / 20.0), 1.0 + 0.1 * (t - 100.0)),
            "grows by 9.99 m in the second half of the run",
        ),
    ],
)
def test_a_run_that_has_not_settled_has_a_trend(error: Callable[[Array], Array], trend: str) -> None:
    assert judged(error).endswith(f"and {trend}.")


def test_a_run_that_failed_states_when_and_why() -> None:
    text = judged(lambda t: np.exp(t / 4.0), duration=40.0, provenance={"failure": "the motion is no longer finite"})
    assert text.startswith("The run failed after 40 s: the motion is no longer finite. The ship does not track the reference:")
    assert "and grows by" in text


@given(noise=st.floats(0.02, 3.0), share=st.floats(0.01, 2.0))
@settings(max_examples=20)
def test_an_error_within_the_noise_of_the_positions_is_no_failure_and_is_given_in_it(noise: float, share: float) -> None:
    """A constant error, of a ship that starts on its reference: without noise, the bound is a hundredth of its length, 0.32 m."""
    assume(abs(share - 1.0) > 1e-9)  # where rounding decides
    text = judged(lambda t: 0.0 * t + share * noise, changes={"vessel_sim.sensors.position_noise": noise})
    assert text.startswith("The ship tracks" if share * noise <= max(noise, 0.32) else "The ship does not track")
    assert f"rms in the last quarter ({number(share)} of the {quantity(noise, 'm')} of noise of its positions), at most" in text


def test_a_boat_is_judged_by_the_noise_that_is_declared_of_its_positions() -> None:
    """Without a plant among the nodes, the sensors of the simulation do not count."""
    declared: dict[str, object] = {"controller.observer.enabled": True, "controller.observer.position_noise": 2.0}
    assert judged(lambda t: 0.0 * t + 1.5, changes=declared, plant=False).startswith("The ship tracks the reference:")
    assert judged(lambda t: 0.0 * t + 1.5, changes=declared).startswith("The ship does not track the reference:")
    sensors: dict[str, object] = {"vessel_sim.sensors.position_noise": 2.0}
    assert judged(lambda t: 0.0 * t + 1.5, changes=sensors, plant=False).startswith("The ship does not track the reference:")


@pytest.mark.parametrize(("law", "setting"), [("guided", "guided.velocity_noise"), ("los_pid", "observer.position_noise")])
def test_chattering_by_the_noise_of_the_positions_names_what_reduces_it(law: str, setting: str) -> None:
    switching: Array = np.where(np.arange(4000) % 2, 1.0, -1.0)
    noisy: dict[str, object] = {"controller.law": law, "vessel_sim.sensors.position_noise": 0.3}
    assert judged(np.zeros_like, lambda _: 1e5 + 1e4 * switching, changes=noisy).endswith(
        f"per second, as its positions have 0.3 m of noise; a larger controller.{setting} reduces it."
    )


def test_a_reference_at_rest_is_station_keeping() -> None:
    text = judged(lambda t: 0.0 * t + 0.01, speed=0.0)
    assert text.startswith("The ship keeps station: the position error is 10 mm rms in the last quarter")
    assert text.endswith("and below 0.32 m all the time.")


def test_a_short_run_is_not_judged() -> None:
    assert judged(lambda t: 1.0 + t, duration=5.0) == (
        "The run of 4.95 s is too short to judge convergence: the position error goes from 1 m to 5.95 m."
    )


def test_saturation_is_stated_with_its_share_of_the_time() -> None:
    text = judged(np.zeros_like, lambda t: np.where(t < 50.0, 2e5, 1e4))
    assert text.endswith("The surge force is at its limit 25 % of the time.")


def test_the_papers_law_has_no_limit_at_which_it_could_be() -> None:
    text = judged(np.zeros_like, lambda t: 0.0 * t + 2e5, changes={"controller.law": "hierarchical_printed"})
    assert "limit" not in text


def test_chattering_is_stated_with_its_size_and_numerical_noise_is_not() -> None:
    switching: Array = np.where(np.arange(4000) % 2, 1.0, -1.0)
    assert "The surge force chatters: it jumps by 20 kN on average, 20 times per second." in judged(
        np.zeros_like, lambda _: 1e5 + 1e4 * switching
    )
    assert "chatter" not in judged(np.zeros_like, lambda _: 1e5 + 1e-6 * switching)


def test_missed_periods_and_dropped_messages_are_stated() -> None:
    text = judged(np.zeros_like, facts={"missed_periods": 7, "messages_dropped": 3})
    assert text.endswith("7 of 7 control periods were missed; the recorder dropped 3 messages.")


def test_what_a_late_recorder_missed_is_stated() -> None:
    text = judged(np.zeros_like, provenance={"joined_late": "1 of /cmd_wrench"})
    assert text.endswith("he recorder joined late and missed 1 of /cmd_wrench.")


def test_a_law_that_controls_the_heading_only_is_judged_by_its_heading() -> None:
    text = judged(lambda t: t, changes={"controller.law": "pd"})
    assert text == "The law controls the heading only: the heading error is 0° rms, 0° at the end."


@pytest.mark.parametrize("law", ["manoeuvre", "open_loop"])
def test_a_law_that_follows_no_reference_is_not_judged_by_one(law: str) -> None:
    assert judged(lambda t: 0.1 * t, changes={"controller.law": law}) == f"The law {law} follows no reference."


def test_a_run_without_a_reference_cannot_be_judged() -> None:
    time = np.arange(10.0)
    record = with_verdict(Record("bag", make_run(time, np.zeros((10, 6)))))
    assert record.verdict == "Without a recorded reference and wrench, the tracking cannot be judged."


def test_a_velocity_for_which_the_hull_data_do_not_hold_is_mentioned() -> None:
    limited: dict[str, object] = {"vessel_sim.vessel.surge_speed_range": [-1.0, 1.5]}
    text = judged(np.zeros_like, changes=limited)
    assert text.endswith("The ship has a surge velocity of 2 m/s, where the hull data hold from -1 to 1.5 m/s.")
    # Through the water: a current of 1 m/s ahead leaves 1 m/s.
    assert "hull data" not in judged(np.zeros_like, changes={**limited, "vessel_sim.disturbance.current.east": 1.0})


@pytest.mark.parametrize(("column", "velocity"), [(3, "surge velocity of -1.2 m/s"), (5, "yaw rate of -0.3 rad/s")])
def test_a_velocity_astern_or_to_starboard_for_which_the_hull_data_do_not_hold_is_mentioned(column: int, velocity: str) -> None:
    time = np.arange(0.0, 200.0, 0.5)
    state = np.zeros((len(time), 6))
    state[:300, column], state[300:, column] = 0.2, float(velocity.split()[-2])
    run = make_run(time, state, reference=state, wrench=np.zeros((len(time), 2)))
    ranges: dict[str, object] = {
        "vessel_sim.vessel.surge_speed_range": [-1.0, 1.5],
        "vessel_sim.vessel.yaw_rate_range": [-0.25, 0.25],
    }
    scenario = load_scenario("case2_tracking", {**GUIDED, **ranges})
    assert velocity in with_verdict(Record("run", run, measured(run, scenario), scenario=scenario)).verdict


@pytest.mark.parametrize("psi", [0.0, 0.7, 0.5 * np.pi, -0.5 * np.pi, np.pi])
def test_the_velocity_through_the_water_is_that_along_the_hull_whatever_its_heading(psi: float) -> None:
    """A current with the ship leaves less, one against it more."""
    time = np.arange(0.0, 200.0, 0.05)
    ahead = np.outer(time, 1.0 * np.array([np.cos(psi), np.sin(psi)]))
    state = np.column_stack([ahead, *np.tile([[psi], [1.0], [0.0], [0.0]], len(time))])
    run = make_run(time, state, reference=state, wrench=np.zeros((len(time), 2)))

    def verdict(current: float) -> str:
        drift = {"east": current * np.cos(psi), "north": current * np.sin(psi)}
        changes = {f"vessel_sim.disturbance.current.{name}": float(value) for name, value in drift.items()}
        bounds: dict[str, object] = {
            "vessel_sim.vessel.surge_speed_range": [-1.0, 1.5],
            "vessel_sim.vessel.sway_speed_range": [-0.1, 0.1],
        }
        scenario = load_scenario("case2_tracking", {**GUIDED, **bounds, **changes})
        return with_verdict(Record("run", run, measured(run, scenario), scenario=scenario)).verdict

    assert "hull data" not in verdict(0.8)
    assert "a surge velocity of 1.8 m/s, where the hull data hold from -1 to 1.5 m/s" in verdict(-0.8)
