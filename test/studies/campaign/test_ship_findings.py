"""Which ships of a family are lost, and why: known counts from invented results."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ship_findings
from campaigns import campaign

from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.studies.campaign import findings
from vessel_hsmc_ros.studies.campaign.plan import Campaign
from vessel_hsmc_ros.studies.campaign.results import Results

LIMIT = "position_error_rms_last_quarter"
VARIANTS = {
    "as declared": {"ship.knowledge": "declared"},
    "nothing declared": {"ship.knowledge": "nothing"},
    "true values": {"ship.knowledge": "true_values"},
    "los_pid": {"ship.knowledge": "declared", "controller.law": "los_pid"},
}
DRAW = {
    "ship.reference": {"choice": ["circle", "rest"]},
    "ship.declares_lag": {"choice": [False, True]},
    "ship.declares_rate": {"choice": [False, True]},
    "ship.declares_dead_time": {"choice": [False]},
    "ship.control_rate_hz": {"choice": [10.0, 50.0]},
}
LOST = {"as declared": (0, 1, 2, 3), "nothing declared": (3, 4), "true values": (2, 3, 5), "los_pid": range(10)}
"""The draws that each variant loses; 10 of 12 are feasible."""


def invented(plan: Campaign) -> Results:
    """The rows of a campaign of 12 draws, of which 10 and 11 are infeasible and kept."""
    planned = [plan.planned(run) for run in range(plan.runs)]
    failed = [each.draw in LOST[each.variant] for each in planned]
    rows: dict[str, Any] = {
        "run": [each.run for each in planned],
        "draw": [each.draw for each in planned],
        "law": [each.law for each in planned],
        "variant": [each.variant for each in planned],
        "failed": failed,
        "failure": [f"{LIMIT} = 1.2 above 0.64" if lost else "" for lost in failed],
        "ended_early": [False] * plan.runs,
        "infeasible": ["the wind" if each.draw >= 10 else "" for each in planned],
        **{name: [each.values[name] for each in planned] for name in plan.drawn},
        **dict.fromkeys(Metrics._fields, np.ones(plan.runs)),
    }
    return Results(plan, {name: np.array(column) for name, column in rows.items()})


def plan_of(folder: Path, **changes: Any) -> Campaign:
    given = {"laws": None, "variants": VARIANTS, "draw": DRAW, "set": {"controller.law": "guided"}, "runs": 12}
    return campaign(folder, limits={LIMIT: {"lengths": 0.02}}, **{**given, **changes})


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return invented(plan_of(tmp_path_factory.mktemp("results")))


def test_the_sentences_count_feasible_ships_that_each_variant_loses(results: Results) -> None:
    found = findings.sentences(results, {})
    assert [variant for variant, _ in found[:4]] == list(VARIANTS)
    assert found[0][1] == "4 of 10 feasible ships lost, 40 % (12 % to 74 % at 95 %)."
    assert found[3][1].startswith("10 of 10 feasible ships lost, 100 %")


def test_ships_lost_because_of_what_is_declared_are_kept_with_nothing_declared(results: Results) -> None:
    ships = ship_findings.ships_of(results)
    because, true = ship_findings.because(ships)
    wrong = ship_findings.wrong(ships)
    assert because.startswith("Because of what was declared 3 of 10, 30 %")  # 0, 1 and 2
    assert true.startswith("Of these, 1 are lost with the true values as well; in all, true values lose 2 of 10, 20 %")  # 2 and 5
    assert wrong == "Of 2 infeasible ships some variant keeps 2; of 10 feasible ones no variant keeps 1."


def test_the_table_sums_up_to_all_ships_in_every_group(results: Results) -> None:
    head, lines = ship_findings.lost(ship_findings.ships_of(results))
    assert head == ["ships", "", "feasible", *VARIANTS]
    names = [line[0] for line in lines]
    assert [name for name in names if name] == ["all", "delays declared", "reference", "control rate"]
    starts = [i for i, name in enumerate(names) if name] + [len(names)]
    for begin, end in itertools.pairwise(starts):
        sums = [sum(int(line[k]) for line in lines[begin:end]) for k in range(2, 7)]
        assert sums == [10, 4, 2, 3, 10]
    labels = [line[1] for line in lines]
    assert set(labels[1:-4]) <= {"none", "lag", "rate", "lag, rate"}
    assert labels[-2:] == ["10 Hz", "50 Hz"]


def test_draws_that_lack_a_variant_do_not_count(results: Results) -> None:
    some = results.rows["run"] < 4 * 5 + 2  # half of the sixth draw
    ships = ship_findings.ships_of(Results(results.campaign, {name: column[some] for name, column in results.rows.items()}))
    assert len(ships.feasible) == 5


def test_reasons_are_counted_in_lengths_of_the_hull(results: Results) -> None:
    assert results.by_variant["as declared"].reasons() == [(f"{LIMIT} above 0.02 lengths", 4)]


@pytest.mark.parametrize("sampling", ["sobol", "latin_hypercube"])
def test_draws_that_are_spread_evenly_have_no_confidence_intervals(results: Results, tmp_path: Path, sampling: str) -> None:
    ships = invented(plan_of(tmp_path, sampling=sampling))
    assert findings.sentences(ships, {})[0][1] == "4 of 10 feasible ships lost, 40 %."
    assert "probability at most (95 %)" in findings.failures(results).head
    assert "probability at most (95 %)" not in findings.failures(ships).head
    assert all(
        not cell.bounds for table in (findings.quantiles, findings.comparisons) for line in table(ships).lines for cell in line
    )
