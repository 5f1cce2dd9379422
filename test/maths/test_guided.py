"""The guided law in the closed loop: short of the whole table, which `make benchmark-guided` runs."""

import numpy as np
import pytest

from vessel_hsmc_ros.closed_loop import load_scenario, simulate
from vessel_hsmc_ros.suite import judge, load_suite

ROWS = {row.name: row for row in load_suite("guided")}


def run_of(row, **changes):
    changes = {name.replace("__", "."): value for name, value in changes.items()}
    return simulate(load_scenario(row.scenario, {**row.changes, **changes}))


@pytest.mark.parametrize("name", ["circle"])
def test_representative_rows_of_the_suite_hold(name):
    row = ROWS[name]
    run = run_of(row)
    verdict = judge(row, run)
    assert verdict.hit, verdict
    assert np.abs(run.wrench[:, 0]).max() <= 2e5
    assert np.abs(run.wrench[:, 1]).max() <= 3e6
