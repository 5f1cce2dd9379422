"""The page of manoeuvres, their metrics as CSV, their scenarios, and the command that writes them."""

import csv
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest
from browser import NEEDED, browser
from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.manoeuvres import page
from vessel_hsmc_ros.studies.manoeuvres.page import TITLES, notes
from vessel_hsmc_ros.studies.manoeuvres.run import PLANS, Results, run, ship_named


@pytest.fixture(scope="module")
def otter() -> Results:
    return run(ship_named("otter"))


@pytest.fixture(scope="module")
def files(otter: Results, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return page.write(tmp_path_factory.mktemp("manoeuvres"), otter)


def vessel_hsmc(*arguments: str) -> Result:
    """Call the command in this process; its errors are raised."""
    return CliRunner().invoke(cli, ["manoeuvres", *arguments], catch_exceptions=False, standalone_mode=False)


def test_the_page_has_a_diagram_and_the_metrics_of_every_manoeuvre(files: dict[str, Path], otter: Results) -> None:
    text = files["page"].read_text()
    figures = json.loads(re.findall(r'id="content">(.*?)</script>', text, re.DOTALL)[0])["figures"]
    assert [len(section) for section in figures] == [0, *[1] * len(PLANS), 0], "between the criteria and the hull data"
    for number, name in enumerate(PLANS, 1):
        assert f"<h2>{TITLES[name]}</h2>" in text
        assert f'data-figure="{number} 0"' in text
        assert all(trace["type"] == "scatter" for trace in figures[number][0]["traces"])
    assert "applies to ships of 100 m and more" in text
    assert "Fossen" in text  # the source of the hull data
    assert otter.ship.scenario.vessel_sim.vessel.name == "otter"


def test_the_page_needs_no_other_file(files: dict[str, Path]) -> None:
    text = files["page"].read_text()
    assert not re.search(r"""(src|href)=["'](?!data:)""", text)
    assert "default-src 'none'" in text


@pytest.mark.long
@NEEDED
def test_the_page_draws_every_diagram_on_a_narrow_screen(files: dict[str, Path]) -> None:
    with browser() as tab:
        tab.open(files["page"], 400)
        assert tab.run("return [...document.querySelectorAll('[data-figure]')].every((each) => each.querySelector('.main-svg'))")
        assert tab.run("return document.documentElement.scrollWidth") <= 400
        assert tab.console() == []


def test_the_turning_circle_has_its_dimensions_drawn_in(otter: Results) -> None:
    drawn = page.turning_circle(otter.manoeuvres["turning_circle"])
    texts = [text for trace in drawn["traces"] for text in trace.get("text", [])]
    for name in ("advance", "transfer", "tactical diameter", "steady diameter"):
        assert any(name in text for text in texts)


def test_the_csv_has_every_metric_with_its_unit(files: dict[str, Path], otter: Results) -> None:
    with files["metrics"].open() as stream:
        lines = list(csv.DictReader(stream))
    assert len(lines) == sum(map(len, otter.metrics.values()))
    advance = next(line for line in lines if line["metric"] == "advance")
    assert float(advance["value"]) == otter.metrics["turning_circle"]["advance"]
    assert (advance["unit"], float(advance["limit"])) == ("m", 9.0)
    assert float(advance["in_lengths"]) == pytest.approx(float(advance["value"]) / 2.0)


def test_a_written_scenario_repeats_the_manoeuvre(files: dict[str, Path], otter: Results) -> None:
    again = load_scenario(files["scenarios"] / "turning_circle.yaml")
    assert again.vessel_sim == otter.manoeuvres["turning_circle"].scenario.vessel_sim
    assert again.controller == otter.manoeuvres["turning_circle"].scenario.controller
    assert simulate(again).time[-1] == again.vessel_sim.duration


def test_an_overshoot_without_bound_is_named_as_such() -> None:
    results = run(ship_named("cybership2"), ["zigzag_10"])
    done = results.manoeuvres["zigzag_10"]
    assert math.isinf(done.metrics["first_overshoot"])
    assert "does not check" in " ".join(notes(done))
    assert "not checked" in page.render(results, Path("scenarios"))


def test_a_manoeuvre_that_leaves_the_range_of_the_hull_data_has_a_note(otter: Results) -> None:
    done = run(ship_named("otter", {"vessel.yaw_rate_range": [-0.1, 0.1]}), ["turning_circle"]).manoeuvres["turning_circle"]
    assert any("yaw rate" in note and "outside the range" in note for note in notes(done))


def test_the_crash_stop_has_the_thrust_astern_of_the_layout() -> None:
    # Two fixed propellers of 66.71 N astern; azimuths turn their whole thrust around; without a layout both ways are alike.
    assert ship_named("otter").astern_force == pytest.approx(2.0 * 66.71)
    for name in ("milliampere", "paper_ship"):
        ship = ship_named(name)
        assert ship.astern_force == ship.largest_force
    done = run(ship_named("otter"), ["crash_stop"]).manoeuvres["crash_stop"]
    assert done.track.force.min() >= -2.0 * 66.71 - 1e-9


def test_the_command_prints_the_metrics_and_writes_the_page(tmp_path: Path) -> None:
    result = vessel_hsmc("paper_ship", "--only", "turning_circle", "--only", "crash_stop", "--output", str(tmp_path))
    assert "tactical diameter" in result.output
    assert "track reach" in result.output
    assert "overshoot" not in result.output
    assert list(tmp_path.glob("*_paper_ship_manoeuvres/manoeuvres.html"))


def test_the_table_of_several_ships_has_a_line_for_each() -> None:
    printed = vessel_hsmc("heron", "wam_v_16", "--only", "crash_stop", "--markdown").output
    lines = [line for line in printed.splitlines() if line.startswith("|")]  # without those of the progress
    assert [line.split(" | ")[0] for line in lines[2:]] == ["| heron", "| wam_v_16"]
    assert lines[0].count("|") == lines[2].count("|")


def test_of_a_scenario_only_the_ship_is_taken(tmp_path: Path) -> None:
    ship = ship_named("realistic")
    sim = ship.scenario.vessel_sim
    assert sim.actuators == load_scenario("realistic").vessel_sim.actuators
    assert sim.sensors.perfect()
    assert sim.disturbance.waves.significant_height == sim.disturbance.current.east == sim.disturbance.periodic.sway_force == 0.0
    own = tmp_path / "own.yaml"
    own.write_text("vessel: {length: 2.0, beam: 1.0, surge_inertia: 60.0}")
    with pytest.raises(ParameterError, match="is missing"):
        ship_named(own)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["oter"], "neither a vessel nor a scenario"),
        (["missing.yaml"], "does not exist"),
        (["otter", "--set", "vessel.lenght=3"], "did you mean"),
        (["otter", "--set", "vessel.surge_damping=0", "--set", "vessel.surge_damping_quadratic=0"], "no steady speed in surge"),
    ],
)
def test_a_wrong_argument_is_reported(arguments: list[str], message: str) -> None:
    with pytest.raises((ParameterError, ScenarioError), match=message):
        vessel_hsmc(*arguments)


def test_an_unknown_manoeuvre_is_reported(otter: Results) -> None:
    unknown: Any = ["williamson_turn"]
    with pytest.raises(ParameterError, match="williamson_turn is unknown: it must be any of turning_circle"):
        run(otter.ship, unknown)
