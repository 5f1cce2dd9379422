"""examples/otter_in_one_file.py: its ship is that of the library, its law keeps the survey, and it draws the picture."""

import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros import load_scenario
from vessel_hsmc_ros.plant.dynamics import derivative

FILE = Path(__file__).parents[2] / "examples" / "otter_in_one_file.py"


@pytest.fixture(scope="module")
def otter() -> dict[str, Any]:
    return runpy.run_path(str(FILE))


def test_its_ship_is_that_of_the_library(otter: dict[str, Any]) -> None:
    changes = {"vessel": "otter", "reference_ship.mode": "straight", "reference_ship.straight.speed": 1.0}
    vessel = load_scenario("case2_straight", changes).vessel_sim.vessel.coefficients()
    drawn = np.random.default_rng(3)
    for _ in range(50):
        state = drawn.normal(size=6) * [50.0, 50.0, 3.0, 2.0, 0.5, 0.5]
        tau = drawn.normal(size=2) * [200.0, 50.0]
        expected = derivative(state, tau, np.zeros(3), vessel, tuple(otter["CURRENT"]))
        assert otter["derivative"](state, np.array([tau[0], 0.0, tau[1]])) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.long
def test_its_law_keeps_the_survey_in_the_current(otter: dict[str, Any]) -> None:
    times, state, desired, wrench = otter["simulate"]()
    error = np.hypot(*(state[:, :2] - desired[:, :2]).T)
    assert error[0] == 2.0
    assert error[times > 20.0].max() < 0.06 * otter["L"]
    assert abs(wrench[:, 0]).max() <= otter["X_MAX"]
    assert abs(wrench[:, 1]).max() <= otter["N_MAX"]


@pytest.mark.long
def test_it_draws_its_picture(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, FILE, "a.png"], cwd=tmp_path, capture_output=True, text=True, timeout=300.0)
    assert "m rms" in done.stdout, done.stderr
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
