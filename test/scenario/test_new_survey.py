"""A survey in a new scenario: legs as given, a run as long as they take, and one clear line where that cannot be."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.own_ship import (
    MainData,
    NewSurvey,
    planned_time,
    scenario_for,
    scenario_text,
    survey_of,
    with_survey,
)
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.scenario.warnings import check_effects, check_scenario

TEXTS = {
    "boat": scenario_text("boat", MainData(length=4.0, wind=5.0, gps_noise=0.5)),
    "otter": scenario_for(read_vessel("otter").values, "otter", "boat"),
}


def sails(scenario: Scenario, survey: NewSurvey) -> None:
    own = scenario.reference_ship.lawnmower
    assert scenario.reference_ship.mode == "lawnmower"
    assert (own.legs, own.leg_length, own.spacing, own.speed) == survey
    assert 1.1 * planned_time(scenario) <= scenario.vessel_sim.duration <= 1.1 * planned_time(scenario) + 10.0


@pytest.mark.long
@settings(max_examples=15, deadline=None)
@given(
    st.sampled_from(sorted(TEXTS)),
    st.integers(1, 6),
    st.floats(20.0, 300.0),
    st.sampled_from([-1.0, 1.0]),
    st.floats(8.0, 60.0),
    st.floats(0.5, 1.0),
)
def test_a_new_survey_has_the_legs_that_are_given_and_a_run_as_long_as_they_take(
    name: str, legs: int, length: float, side: float, spacing: float, speed: float
) -> None:
    survey = NewSurvey(legs, length, side * spacing, speed)
    scenario = parse_scenario(with_survey(TEXTS[name], survey), "new")
    sails(scenario, survey)
    assert check_scenario(scenario) == check_effects(scenario) == []


@pytest.mark.long
def test_init_writes_the_survey_that_its_option_gives(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    done = CliRunner().invoke(cli, ["init", str(path), "--vessel", "otter", "--survey", "3,50,-9,0.8", "--no-check"])
    assert done.exit_code == 0, done.output
    sails(load_scenario(path), NewSurvey(3, 50.0, -9.0, 0.8))
    text = path.read_text(encoding="utf-8")
    assert "mode: lawnmower                     # or circle, straight, figure_eight, square, path, goal" in text
    assert "vessel otter on a survey" in text


@pytest.mark.parametrize("text", ["", "4", "4,40,8", "4,40,8,1,1", "4.5,40,8,1", "a,40,8,1", "inf,40,8,1", "nan,40,8,1"])
def test_a_survey_that_is_not_four_numbers_is_refused(text: str) -> None:
    with pytest.raises(ParameterError, match=r"--survey must be legs,length,spacing,speed: .* \(got "):
        survey_of(text)


@pytest.mark.parametrize("text", ["4,40,0,1", "4,40,8,99", "0,40,8,1", "4,-1,8,1", "4,40,8,0"])
def test_a_survey_that_cannot_be_sailed_is_refused_and_nothing_is_written(tmp_path: Path, text: str) -> None:
    path = tmp_path / "mine.yaml"
    done = CliRunner().invoke(cli, ["init", str(path), "--vessel", "otter", "--survey", text, "--no-check"])
    assert isinstance(done.exception, ParameterError)
    assert str(done.exception).startswith("--survey: reference_ship.lawnmower.")
    assert not path.exists()


def test_the_survey_of_the_package_ends_with_a_reserve() -> None:
    scenario = load_scenario("survey")
    assert 1.05 * planned_time(scenario) < scenario.vessel_sim.duration
