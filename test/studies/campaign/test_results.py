"""The rows of a campaign by law and draw."""

from pathlib import Path

import numpy as np
import pytest
from campaigns import campaign

from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.studies.campaign.distributions import noise_seed
from vessel_hsmc_ros.studies.campaign.report import _subtitle, diagrams
from vessel_hsmc_ros.studies.campaign.results import ALWAYS, LENGTH, Influence, Results


def test_laws_are_compared_on_the_same_draws_where_each_lacks_some(tmp_path: Path) -> None:
    """The metric of a row shows its law and its draw."""
    plan = campaign(tmp_path)
    draws = {"los_pid": [0, 2, 3, 5], "hierarchical_printed": [5, 1, 0, 3]}
    rows = [(law, draw) for law, those in draws.items() for draw in those]
    results = Results(
        plan,
        {
            "run": np.arange(len(rows)),
            "draw": np.array([draw for _, draw in rows]),
            plan.variant_column: np.array([law for law, _ in rows]),
            "ended_early": np.zeros(len(rows), bool),
            "failed": np.zeros(len(rows), bool),
            ALWAYS[0]: np.array([draw + (100.0 if law == "hierarchical_printed" else 0.0) for law, draw in rows]),
        },
    )
    first, second = results.paired("los_pid", "hierarchical_printed", ALWAYS[0])
    assert (first.tolist(), second.tolist()) == ([0.0, 3.0, 5.0], [100.0, 103.0, 105.0])


def test_campaigns_of_neighbouring_seeds_share_no_noise() -> None:
    seeds = [noise_seed(seed, draw) for seed in range(20) for draw in range(500)]
    assert len(set(seeds)) == len(seeds)


def test_a_metric_with_a_limit_in_lengths_is_in_those_of_the_hull_that_was_drawn(tmp_path: Path) -> None:
    plan = campaign(tmp_path, limits={ALWAYS[0]: {"lengths": 0.02}})
    rows = {"run": np.arange(2), ALWAYS[0]: np.array([1.0, -1.0]), "ended_early": np.zeros(2, bool)}
    assert Results(plan, {**rows, LENGTH: np.array([5.0, 20.0])}).cost(ALWAYS[0]).tolist() == [0.2, 0.05]
    assert Results(plan, rows).cost(ALWAYS[0]).tolist() == [1.0 / plan.base.vessel_sim.vessel.length] * 2


@pytest.mark.parametrize(("rows", "shown"), [(1, "1 of 10 runs so far"), (5, "5 of 10"), (9, "9 of 10"), (10, "10 runs (")])
def test_a_campaign_of_several_laws_is_complete_with_the_rows_of_all(tmp_path: Path, rows: int, shown: str) -> None:
    plan = campaign(tmp_path)
    assert (plan.draws, plan.runs) == (5, 10)
    assert _subtitle(Results(plan, {"run": np.arange(rows)})).startswith(shown)


def test_all_laws_of_a_diagram_are_drawn_in_one_unit(tmp_path: Path) -> None:
    """One law needs newton metres, the other meganewton metres; the limit lies between them."""
    plan = campaign(tmp_path, laws=["los_pid", "hierarchical_printed"], limits={"yaw_moment_rms": 4e4})
    n = 20
    size = np.where(np.arange(2 * n) < n, 50.0, 4e6) * (1.0 + np.arange(2 * n) % n)
    rows = {
        **dict.fromkeys(Metrics._fields, np.full(2 * n, np.nan)),
        "run": np.arange(2 * n),
        "draw": np.arange(2 * n) % n,
        plan.variant_column: np.repeat(["los_pid", "hierarchical_printed"], n),
        "ended_early": np.zeros(2 * n, bool),
        "failed": size > 4e4,
        "yaw_moment_rms": size,
        **{name: 1.0 + np.arange(2 * n) % n for name in plan.drawn},
    }
    found = {law: [Influence(name, 0.5, 0.1, 1.0) for name in plan.drawn] for law in plan.laws}
    drawn = diagrams(Results(plan, rows), found)
    (curves,) = (each for each in drawn["exceedance"] if each["title"].startswith("yaw moment, rms"))
    name = curves["title"]
    assert name == "yaw moment, rms [MN·m]"
    weak, strong = (max(trace["x"]) for trace in curves["traces"] if trace["name"])
    assert (weak, strong, curves["layout"]["shapes"][0]["x0"]) == pytest.approx((1e-3, 80.0, 0.04))
    assert [each["title"] for each in drawn["scatter"]] == [f"{law}: {name}" for law in plan.laws for _ in range(2)]
    largest = [max(value for trace in each["traces"] for value in trace["y"]) for each in drawn["scatter"]]
    assert largest == pytest.approx([weak, weak, strong, strong])
