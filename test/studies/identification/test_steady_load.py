"""Why a run that was not used is predicted badly: the steady force or current that would explain it."""

import numpy as np
import pytest

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.studies.identification.page import steady_load, towards
from vessel_hsmc_ros.studies.identification.types import Measurements, simulated, unrolled, windows
from vessel_sim_node.plant import VesselParameters

SHIP = VesselParameters()
HULL = {name: value for name, value in schema.flatten(SHIP).items() if isinstance(value, float)}
WINDOW = 20.0
TIME = np.arange(0.0, 60.5, 0.5)


def sailed(force: tuple[float, float], current: tuple[float, float] = (0.0, 0.0)) -> Measurements:
    """A run of the ship with a steady force in the earth frame, in a steady current."""
    wrench = np.column_stack([1e5 + 0.0 * TIME, 0.0 * TIME, 2e5 * np.sin(0.2 * TIME)])
    blank = Measurements(TIME, np.zeros((len(TIME), 3)), np.zeros((len(TIME), 3)), wrench)
    cut = windows([blank], 60.0)
    offsets, currents = np.array([*force, 0.0]), np.array([current])
    parts = simulated(cut, np.zeros((1, 6)), SHIP.coefficients(), np.ones(3), offsets, currents=currents)
    states = unrolled(cut, parts, len(TIME))
    return Measurements(TIME, states[:, :3], states[:, 3:], wrench, "windy")


def test_a_wind_that_the_other_runs_did_not_have_is_found_and_explains_the_run() -> None:
    found = steady_load(HULL, sailed((3e3, -4e3)), WINDOW, {})
    assert (found.x, found.y) == pytest.approx((3e3, -4e3), rel=0.01)
    assert found.explains
    assert found.kind == "force"
    assert found.sentence("windy").startswith("windy: a steady force of 5 kN towards -53° from x explains the position error of ")


@pytest.mark.parametrize("current", [(0.4, -0.3), (0.0, 0.1), (-1.0, 0.0)])
def test_a_current_that_the_other_runs_did_not_have_is_found_and_explains_the_run(current: tuple[float, float]) -> None:
    found = steady_load(HULL, sailed((0.0, 0.0), current), WINDOW, {})
    assert found.kind == "current"
    assert (found.x, found.y) == pytest.approx(current, abs=0.01)
    assert found.explains
    assert found.sentence("fast").startswith(f"fast: a steady current of {towards(*current, 'm/s')} from x explains the position")


def test_a_force_is_not_offered_where_it_does_not_explain_the_run() -> None:
    run = sailed((0.0, 0.0))
    turned = run._replace(wrench=run.wrench * [1.0, 1.0, -1.0])
    found = steady_load(HULL, turned, WINDOW, {})
    assert not found.explains
    assert found.sentence("windy").startswith("windy: no steady force or current explains the position error of ")


def test_the_force_is_found_beside_the_offset_that_was_identified() -> None:
    found = steady_load(HULL, sailed((4e3, -4e3)), WINDOW, {"force_x": 1e3})
    assert (found.x, found.y) == pytest.approx((3e3, -4e3), rel=0.01)
