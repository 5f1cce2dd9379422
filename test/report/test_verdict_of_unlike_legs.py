"""The verdict on surveys, turned ships and references that come to rest, where the legs and halves of a run differ."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from records import make_run

from vessel_hsmc_ros.core.metrics import Metrics, TrackErrors
from vessel_hsmc_ros.report import Record, record
from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.scenario.scenario import load_scenario

TIME = np.arange(0.0, 200.0, 0.5)


def moving(error: Any = 0.0, heading_deg: float = 0.0, rests_from: float = 1e9) -> Record:
    """A ship at a distance from a reference that moves until a time."""
    zero = 0.0 * TIME
    speed = np.where(rests_from > TIME, 2.0, 0.0)
    reference = np.column_stack([np.cumsum(speed) * 0.5, zero, zero, speed, zero, zero])
    state = reference + np.column_stack([zero + error, zero, zero + np.radians(heading_deg), zero, zero, zero])
    run = make_run(TIME, state, reference=reference, wrench=np.zeros((len(TIME), 2)))
    scenario = load_scenario("case2_tracking", {"controller.law": "guided"})
    return Record("run", run, measured(run, scenario), scenario=scenario)


@pytest.mark.parametrize(("length", "relative"), [(32.0, " (0.0125 lengths)"), (4000.0, "")])
def test_the_worst_leg_is_that_of_the_largest_error_and_counts_from_one(
    monkeypatch: pytest.MonkeyPatch, length: float, relative: str
) -> None:
    # The second leg has the largest error, the first the largest rms.
    cross = np.concatenate([np.full(100, 0.5), np.zeros(99), [-2.0], np.full(100, 0.1)])
    errors = TrackErrors(np.repeat([0, 1, 2], 100), np.zeros(300, bool), cross, cross)
    monkeypatch.setattr(record, "hull_length", lambda _: length)
    given = {"leg_cross_track_rms": 0.4, "leg_cross_track_peak": 2.0, "turn_cross_track_rms": 0.75}
    metrics = Metrics(*np.arange(10.0))._replace(**given)
    found = record._survey(replace(moving(), track_errors=errors), metrics)
    assert f"0.4 m rms{relative} off the line, at most 2 m on leg 2; 0.75 m rms in its turns." in found


@pytest.mark.parametrize(("angle", "mentioned"), [(30.0, True), (-30.0, True), (15.0, False), (-15.0, False)])
def test_a_heading_error_to_either_side_is_mentioned(angle: float, mentioned: bool) -> None:
    text = record.with_verdict(moving(heading_deg=angle)).verdict.replace("−", "-")
    assert (f"with a heading error of {angle:g}° at the end" in text) == mentioned


@pytest.mark.parametrize(("rests_from", "words"), [(100.0, "keeps station"), (1e9, "tracks the reference")])
def test_a_reference_that_comes_to_rest_is_station_keeping(rests_from: float, words: str) -> None:
    assert record.with_verdict(moving(rests_from=rests_from)).verdict.startswith(f"The ship {words}:")


def test_a_peak_at_the_end_of_a_calm_run_is_no_tracking() -> None:
    text = record.with_verdict(moving(np.where((TIME > 170.0) & (TIME < 171.0), 3.0, 0.0))).verdict
    assert text.startswith("The ship does not track the reference")


@pytest.mark.parametrize(("missed", "mentioned"), [(1, False), (2, True)])
def test_missed_periods_are_mentioned_from_a_hundredth_of_all_on(missed: int, mentioned: bool) -> None:
    made = moving()
    made.run.control["time"] = np.arange(198.0)
    text = " ".join(record._losses(Record("run", made.run, facts={"missed_periods": missed})))
    assert (text == f"{missed} of {198 + missed} control periods were missed") == mentioned
    assert bool(text) == mentioned
