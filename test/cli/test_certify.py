"""`vessel-hsmc certify`: bounds or the condition that fails, for people and for programs."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.control.laws.hierarchical_parameters import Interval
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.studies.certificate import Clause

SHORT = ("--set", "controller.law=hierarchical")


def certify(*arguments: str) -> str:
    return (
        CliRunner(env={"COLUMNS": "140"})
        .invoke(cli, ["certify", *arguments], catch_exceptions=False, standalone_mode=False)
        .output
    )


@pytest.mark.long
def test_it_prints_conditions_bounds_and_limits() -> None:
    text = certify("case2_tracking", *SHORT)
    for part in ("under way", "at rest"):
        assert f"the hierarchical law {part} keeps the position within" in text
    for line in ("Routh ratio", "lowest control rate: ", "largest lag and dead time", "tightest turn", "no law keeps a leg"):
        assert line in text


@pytest.mark.long
def test_in_calm_water_it_says_that_no_error_is_left_and_of_what_the_long_time_constant_is(tmp_path: Path) -> None:
    path = tmp_path / "boat.yaml"
    path.write_text(scenario_text("boat", MainData(length=3.0)))
    (line,) = [each for each in certify(str(path), *SHORT).splitlines() if " under way " in each and each.startswith("the ")]
    assert line.startswith("the hierarchical law under way leaves no position error in the end; time constant at most ")
    assert re.search(r"at most [\d.]+ s, in a turn [\d.]+ s of the estimated current$", line)


def test_a_condition_that_fails_by_far_has_a_readable_number() -> None:
    assert str(Clause("damping", Interval(-237.1, -237.1))) == "damping must exceed 1 (got -237)"
    assert str(Clause("damping", Interval(0.621, 0.95))) == "damping must exceed 1 (got 0.621 to 0.95)"


def test_programs_get_bounds_conditions_and_limits_in_numbers() -> None:
    found = json.loads(certify("case3_stabilisation", *SHORT, "--json"))
    assert set(found) == {"at rest", "limits"}
    assert found["at rest"]["bound"] > 0.0
    assert all(each["holds"] for each in found["at rest"]["conditions"].values())
    assert found["limits"]["rate"] > 0.0
    assert found["limits"]["turn"] is None


@pytest.mark.long
def test_what_the_bounds_do_not_cover_is_said() -> None:
    waves = "vessel_sim.disturbance.waves.significant_height=0.5"
    text = certify("case3_stabilisation", *SHORT, "--set", waves, "--set", "controller.observer.enabled=true")
    assert "the bounds do not cover the noise that the observer leaves and the waves" in text


@pytest.mark.long
def test_the_executable_names_the_condition_that_a_cybership_fails(tmp_path) -> None:
    path = tmp_path / "model.yaml"
    run = [sys.executable, "-m", "vessel_hsmc_ros.cli.main"]
    subprocess.run([*run, "init", str(path), "--vessel", "cybership2", "--no-check"], check=True, timeout=120)
    done = subprocess.run([*run, "certify", str(path)], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert "no certificate of the hierarchical law under way: course by heading (1 + lam·D)/K must exceed 1" in " ".join(
        (done.stdout + done.stderr).split()
    )
