"""Tables, metrics and facts of a record in which every value is unlike every other."""

from pathlib import Path
from typing import Any

import bag_making
import numpy as np
import pytest
from numpy.typing import NDArray
from records import make_run

from vessel_hsmc_ros.bags.reader import Bag, Event
from vessel_hsmc_ros.core.metrics import Metrics, Run
from vessel_hsmc_ros.report import Record, from_bag
from vessel_hsmc_ros.report.page import read
from vessel_hsmc_ros.report.record import Mark, measured, over_shared_interval
from vessel_hsmc_ros.report.tables import metrics_table, parameter_tables, provenance_table, rows, text
from vessel_hsmc_ros.scenario.scenario import load_scenario

Array = NDArray[Any]

UNLIKE = Metrics(
    position_error_rms=1.5,
    position_error_rms_last_quarter=2.5,
    position_error_final=3.5,
    heading_error_rms_deg=4.5,
    heading_error_final_deg=-5.5,
    surge_force_peak=6.5,
    surge_force_rms=7.5,
    yaw_moment_peak=8.5,
    yaw_moment_rms=9.5,
    position_error_peak_last_quarter=10.5,
    settling_time=11.5,
    surge_force_at_limit=0.125,
    yaw_moment_at_limit=0.135,
    surge_force_travel=14.5,
    yaw_moment_travel=15.5,
    leg_cross_track_rms=16.5,
    leg_cross_track_peak=17.5,
    leg_along_track_rms=18.5,
    turn_cross_track_rms=19.5,
    legs_missed=0.205,
)
FACTS: dict[str, Any] = {
    "run_duration": 21.5,
    "metrics_interval": 22.5,
    "missed_periods": 23,
    "control_interval_deviation_max": 24.5,
    "messages_recorded": 25,
    "messages_dropped": 26,
    "start_up": 27.5,
    "real_time_factor": 28.5,
}
TEXTS = {
    "legs, cross-track error, rms": "16.5 m",
    "legs, cross-track error, largest": "17.5 m",
    "legs, along-track error, rms": "18.5 m",
    "legs, share of their length that was missed": "20.5 %",
    "turns, cross-track error, rms": "19.5 m",
    "position error, rms of the last quarter": "2.5 m",
    "position error, largest of the last quarter": "10.5 m",
    "position error, final": "3.5 m",
    "position error, settling time": "11.5 s",
    "position error, rms with the approach": "1.5 m",
    "heading error, final": "-5.5°",
    "heading error, rms with the approach": "4.5°",
    "surge force, peak": "6.5 N",
    "surge force, rms": "7.5 N",
    "surge force, time at its limit": "12.5 %",
    "surge force, travel relative to its limit": "14.5 1/min",
    "yaw moment, peak": "8.5 N·m",
    "yaw moment, rms": "9.5 N·m",
    "yaw moment, time at its limit": "13.5 %",
    "yaw moment, travel relative to its limit": "15.5 1/min",
    "duration of the run": "21.5 s",
    "metrics above: over the first, which all runs share": "22.5 s",
    "control periods missed": "23",
    "control interval, largest deviation": "24.5 s",
    "messages recorded": "25",
    "messages dropped": "26",
    "from the command to the first control step": "27.5 s",
    "real-time factor": "28.5",
}
BETTER_IF_LESS = [*[*TEXTS][:20], "control periods missed", "messages dropped"]


def still(name: str, end: float = 10.0, **known: Any) -> Record:
    time = np.arange(0.0, end, 0.1)
    return Record(name, make_run(time, np.zeros((len(time), 6))), **known)


def test_every_metric_and_fact_is_shown_under_its_own_name() -> None:
    assert {label: shown.replace("−", "-") for label, shown in rows(UNLIKE, FACTS)} == TEXTS
    for name, value in UNLIKE._asdict().items():
        assert text(name, value).replace("−", "-") in TEXTS.values()
        assert text(name, float("inf")) == "–"


def test_every_metric_of_which_less_is_better_is_judged_and_nothing_else() -> None:
    less = Metrics(*(0.5 * (value or 0.0) for value in UNLIKE))
    half = {name: 0.5 * value for name, value in FACTS.items()}
    table = metrics_table([still("one", metrics=UNLIKE, facts=FACTS), still("two", metrics=less, facts=half)])
    assert [row.label for row in table if row.sense(1) == "better"] == BETTER_IF_LESS
    assert [row.label for row in table if row.sense(1) == "worse"] == []
    for row in table:
        relative = row.label in [*TEXTS][:20] and row.values[0] is not None and row.values[0].unit != "%"
        assert ("50 %)" in row.difference(1)) == relative, row.label


@pytest.mark.parametrize(
    ("first", "other", "shown", "sense"),
    [
        (2.0, 3.0, "+1 m (+50 %)", "worse"),
        (4.0, 3.0, "-1 m (-25 %)", "better"),
        (100.0, 100.99, "+0.99 m (+0.99 %)", ""),
        (100.0, 98.5, "-1.5 m (-1.5 %)", "better"),
        (0.1, 1.0, "+0.9 m (+900 %)", "worse"),
        (0.1, 1.2, "+1.1 m", "worse"),
        (3.0, 3.0, "", ""),
    ],
)
def test_a_difference_is_relative_to_the_first_run(first: float, other: float, shown: str, sense: str) -> None:
    runs = [still(str(value), metrics=UNLIKE._replace(position_error_final=value)) for value in (first, other)]
    row = next(row for row in metrics_table(runs) if row.label == "position error, final")
    assert (row.difference(1).replace("−", "-"), row.sense(1)) == (shown, sense)


@pytest.mark.parametrize(
    ("first", "other", "shown", "sense"),
    [
        (4.0, 3.0, "-1° (-25 %)", "better"),
        (-4.0, -3.0, "+1° (+25 %)", "better"),
        (-4.0, -5.0, "-1° (-25 %)", "worse"),
        (-4.0, 3.0, "+7° (+175 %)", "better"),
        (4.0, -5.0, "-9° (-225 %)", "worse"),
        (-4.0, 4.0, "+8° (+200 %)", ""),
    ],
)
def test_a_difference_of_values_of_either_sign_has_its_own_sign_and_the_nearer_to_zero_is_better(
    first: float, other: float, shown: str, sense: str
) -> None:
    runs = [still(str(value), metrics=UNLIKE._replace(heading_error_final_deg=value)) for value in (first, other)]
    row = next(row for row in metrics_table(runs) if row.label == "heading error, final")
    assert (row.difference(1).replace("−", "-"), row.sense(1)) == (shown, sense)


def test_a_parameter_that_differs_in_any_of_three_runs_is_marked() -> None:
    changes: list[dict[str, Any]] = [{}, {"vessel_sim.seed": 5}, {"controller.hierarchical_printed.sway_weight": 0.002}]
    runs = [still("run", scenario=load_scenario("case2_tracking", each)) for each in changes]
    found = {f"{node['name']}.{row['name']}": row for node in parameter_tables(runs) for row in node["rows"]}
    assert {name for name, row in found.items() if row["changed"]} == {
        "vessel_sim.seed",
        "controller.hierarchical_printed.sway_weight",
    }
    assert found["vessel_sim.seed"]["values"] == ["0", "5", "0"]
    assert found["controller.hierarchical_printed.sway_weight"]["values"] == ["0.001", "0.001", "0.002"]


def test_every_run_has_its_own_origin() -> None:
    runs = [still("one", provenance={"host": "a", "git_commit": "b"}), still("two", provenance={"host": "c", "seed": 5})]
    assert provenance_table(runs) == [
        {"label": "host", "values": ["a", "c"]},
        {"label": "git commit", "values": ["b", "–"]},
        {"label": "seed", "values": ["–", "5"]},
    ]


def at_limits(surge: float, yaw: float, samples: int = 400) -> Run:
    """A run under a constant force and moment, 3 m beside its reference, then 0.3 m from the middle on."""
    time = 0.1 * np.arange(samples)
    state = np.zeros((samples, 6))
    state[:, 0] = np.where(time < 20.0, 3.0, 0.3)
    wrench = np.tile([surge, yaw], (samples, 1))
    return make_run(time, state, reference=np.zeros((samples, 6)), wrench=wrench)


@pytest.mark.parametrize(
    ("changes", "surge", "yaw"),
    [
        ({"controller.law": "guided"}, 2e5, 3e6),
        ({"controller.law": "guided", "vessel_sim.actuators.surge_force_limit": 1.5e5}, 1.5e5, 3e6),
        ({"controller.law": "guided", "vessel_sim.vessel.yaw_moment_limit": 2.5e6}, 2e5, 2.5e6),
        (
            {
                "controller.law": "hierarchical_printed",
                "vessel_sim.vessel.surge_force_limit": 1.2e5,
                "vessel_sim.actuators.yaw_moment_limit": 1.7e6,
            },
            1.2e5,
            1.7e6,
        ),
    ],
)
def test_the_smallest_limit_of_each_input_counts(changes: dict[str, Any], surge: float, yaw: float) -> None:
    scenario = load_scenario("case2_tracking", changes)
    for force, moment, at in ((surge, 0.9 * yaw, (1.0, 0.0)), (0.9 * surge, yaw, (0.0, 1.0))):
        found = measured(at_limits(force, moment), scenario)
        assert found is not None
        assert (found.surge_force_at_limit, found.yaw_moment_at_limit) == at


@pytest.mark.parametrize(("length", "settled"), [(32.0, 20.0), (8.0, None)])
def test_the_bound_of_the_settling_time_is_that_of_the_hull(length: float, settled: float | None) -> None:
    found = measured(at_limits(0.0, 0.0), load_scenario("case2_tracking", {"vessel_sim.vessel.length": length}))
    assert found is not None
    assert found.settling_time == (None if settled is None else pytest.approx(settled, abs=0.11))


def test_the_shared_interval_is_that_of_the_shortest_run_wherever_it_stands() -> None:
    runs = []
    for samples in (400, 150, 300):
        made = at_limits(0.0, 0.0, samples)
        runs.append(Record(str(samples), made, measured(made)))
    for order in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        for found in over_shared_interval([runs[k] for k in order]):
            assert found.metrics is not None
            assert (found.metrics.position_error_final, found.facts["metrics_interval"]) == (3.0, pytest.approx(14.9))
            assert found.facts["run_duration"] == found.duration


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    bag_making.write_run(tmp_path / "bag", 300)
    return tmp_path / "bag"


DIAGNOSTICS = {
    "vessel_sim": {"steps": "41", "wall_time": "42.5", "loop_time": "50", "real_time_factor": "43.5", "first_command_at": "44.5"},
    "controller": {"missed_periods": "45", "compute_time_max": "46.5", "compute_time": "47.5"},
    "recorder": {"dropped": "48", "recorded": "49"},
}


def test_every_fact_is_the_value_of_its_own_node(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Bag, "diagnostics", lambda *_: DIAGNOSTICS)
    assert read([recorded])[0].facts == {
        "messages_recorded": 3003,
        "steps": 41,
        "loop_time": 42.5,
        "real_time_factor": 43.5,
        "first_command_at": 44.5,
        "missed_periods": 45,
        "compute_time_max": 46.5,
        "messages_dropped": 48,
    }


@pytest.mark.parametrize(("late", "deviation"), [(0.07, 0.05), (0.005, 0.015)])
def test_the_largest_deviation_of_the_control_interval_is_to_either_side(late: float, deviation: float) -> None:
    scenario = load_scenario(
        "case2_tracking",
        {
            **{f"{node}.lockstep": False for node in ("vessel_sim", "reference_ship", "controller")},
            "controller.rate_hz": 50.0,
            "controller.law": "guided",
        },
    )
    times = np.cumsum([0.0, 0.02, 0.021, late, 0.02])
    intervals = np.diff(times)

    class OneVessel:
        """A bag without diagnostics."""

        count, namespaces, topics, recording = 7, ("/",), {}, {}

        def diagnostics(self, _: str) -> dict[str, dict[str, str]]:
            return {}

    facts = from_bag._facts(OneVessel(), "/", scenario, intervals)  # type: ignore[arg-type]
    assert facts == {"messages_recorded": 7, "control_interval_deviation_max": pytest.approx(deviation)}


def test_events_of_one_kind_within_a_second_are_one_mark() -> None:
    events = [
        Event(1.0, "vessel_sim", "pause", "paused"),
        Event(1.2, "controller", "stop", "stopped"),
        Event(1.3, "reference_ship", "stop", "stopped"),
        Event(2.5, "controller", "stop", "stopped"),
        Event(3.0, "odom", "fault", "odom: drop"),
        Event(3.1, "odom", "fault", "odom: delay"),
    ]
    assert from_bag._marks(events) == (
        Mark(1.0, "pause", "vessel_sim"),
        Mark(1.2, "stop", "controller, reference_ship"),
        Mark(2.5, "stop", "controller"),
        Mark(3.0, "fault", "odom: drop"),
        Mark(3.1, "fault", "odom: delay"),
    )
