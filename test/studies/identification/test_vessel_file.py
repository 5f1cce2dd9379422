"""The vessel file and the page of an identification, from a made-up result."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.identification import estimate, page
from vessel_hsmc_ros.studies.identification.page import HeldOut, SteadyLoad, known_of, render, vessel_text
from vessel_hsmc_ros.studies.identification.types import Identified, Measurements, Prediction, model

TIME = np.arange(0.0, 40.0, 0.1)
SIZE = len(TIME)
HULL = {
    "surge_inertia": 60.0,
    "sway_inertia": 140.0,
    "yaw_inertia": 40.0,
    "surge_damping": 70.123456789,
    "sway_damping": 130.0,
    "yaw_damping": 39.0,
    "yaw_damping_quadratic": 0.0,
}
RUN = Measurements(TIME, np.zeros((SIZE, 3)), np.zeros((SIZE, 3)), np.tile([100.0, 0.0, -20.0], (SIZE, 1)), "sea trial <1>")


def prediction() -> Prediction:
    errors = np.array([0.1, 0.2])
    return Prediction(20.0, TIME[[0, 200]], errors, errors, np.ones((2, 3)), np.zeros((SIZE, 6)), np.zeros((SIZE, 6)), TIME)


@pytest.fixture
def found() -> Identified:
    names = list(HULL)[:-1]
    return Identified(
        model("paper"),
        HULL,
        {},
        dict.fromkeys(names, 1.5),
        np.eye(len(names)),
        (("yaw_damping_quadratic", "its standard error exceeds its value"),),
        ("surge_inertia and surge_damping are strongly correlated",),
        (np.zeros((SIZE, 6)),),
        np.ones(6),
        (prediction(),),
        np.array([[0.0, 2.0], [-0.5, 0.5], [-0.4, 0.4]]),
    )


def test_the_vessel_file_is_one_of_the_library_with_limits_and_ranges_of_the_data(found: Identified, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(vessel_text("Mine", found, [RUN], {"length": 2.0, "beam": 1.0}, {"position": "0.1 m"}))
    vessel = read_vessel(path)
    assert (vessel.name, vessel.key) == ("Mine", "mine")
    assert vessel.values["vessel.surge_damping"] == 70.1235
    assert vessel.values["vessel.surge_force_limit"] == 100.0
    assert vessel.values["vessel.yaw_moment_limit"] == 20.0
    assert vessel.values["vessel.surge_speed_range"] == (0.0, 2.0)
    assert "position on held-out data: 0.1 m" in vessel.verified
    assert any(line.startswith("yaw_damping_quadratic is held") for line in vessel.unverified)


def test_what_a_start_vessel_knows_besides_is_kept(found: Identified, tmp_path: Path) -> None:
    otter = read_vessel("otter")
    known = known_of(otter.values, found.values)
    path = tmp_path / "mine.yaml"
    path.write_text(vessel_text("Mine", found, [RUN], known, {}))
    mine = read_vessel(path).values
    assert mine["vessel.surge_inertia"] == 60.0
    for name in ("length", "beam", "surge_force_limit"):
        assert mine[f"vessel.{name}"] == otter.values[f"vessel.{name}"]


@pytest.mark.parametrize("given", ["length", "beam"])
def test_a_length_or_beam_that_is_given_takes_the_place_of_that_of_the_start_vessel(
    found: Identified, tmp_path: Path, given: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(estimate, "identify", lambda *_: found)
    monkeypatch.setattr(page, "render", lambda *_: "")
    rows = [f"{t},{t},0,0,1" for t in TIME]
    (tmp_path / "run.csv").write_text("\n".join(["time,x,y,heading,surge_force", *rows]))
    arguments = ["identify", tmp_path / "run.csv", "--vessel", "otter", f"--{given}", "2.75", "--output", tmp_path]
    assert CliRunner().invoke(cli, [str(each) for each in arguments]).exit_code == 0
    mine, otter = read_vessel(tmp_path / "identified.yaml").values, read_vessel("otter").values
    for name in ("length", "beam"):
        assert mine[f"vessel.{name}"] == (2.75 if name == given else otter[f"vessel.{name}"])


def test_length_and_beam_must_be_known(found: Identified) -> None:
    with pytest.raises(ParameterError, match="the length of the ship is not known: give --vessel START, or --length"):
        vessel_text("Mine", found, [RUN], {}, {})


def test_the_page_is_one_file_with_all_its_parts(found: Identified) -> None:
    held_out = HeldOut(RUN._replace(name="unseen"), prediction(), prediction(), SteadyLoad("force", 30.0, 40.0, 9.0, 1.0))
    page = render("Mine", [RUN], found, [held_out])
    assert "unseen: a steady force of 50 N towards 53° from x explains the position error of 9 m (1 m with it)" in page
    for part in ("Held out: unseen", "held out, start vessel: unseen", "Used: sea trial &lt;1&gt;", "Residuals", "Correlations"):
        assert part in page
    assert page.count("data-figure=") == 4 + 4 + 6 + 1
    assert "surge_inertia and surge_damping are strongly correlated" in page
    assert "http" not in page.replace("http-equiv", "")
