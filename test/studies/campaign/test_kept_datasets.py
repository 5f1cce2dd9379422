"""What makes a campaign another one, which values count in a run, and what a folder keeps whenever its process is killed."""

import json
import logging
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from campaigns import FORCE, INERTIA, SEED, X, campaign, campaign_file

from vessel_hsmc_ros.core.exceptions import CampaignError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.studies.campaign import dataset as datasets
from vessel_hsmc_ros.studies.campaign.dataset import Dataset, Row, check_chunk, opened, read_rows, write_file, write_table
from vessel_hsmc_ros.studies.campaign.plan import Campaign

HEADING = "vessel_sim.initial_pose[2]"
LAWS = ["los_pid", "hierarchical_printed"]


def test_all_drawn_elements_of_a_list_are_in_it(tmp_path: Path) -> None:
    plan = campaign(tmp_path, draw={X: {"uniform": [1, 2]}, INERTIA: {"uniform": [4e4, 5e4]}, HEADING: {"uniform": [0, 1]}})
    values = plan.values(2)
    assert plan.scenario(4).vessel_sim.initial_pose == (values[X], 1.0, values[HEADING])
    assert plan.scenario(4).controller.vessel.surge_inertia == values[INERTIA]
    assert len(set(values.values())) == 3


def test_a_drawn_value_counts_more_than_one_that_is_set_and_a_further_change_most(tmp_path: Path) -> None:
    plan = campaign(tmp_path, set={"vessel_sim.duration": 0.5, FORCE: 7.0, SEED: 7}, draw={FORCE: {"uniform": [1, 2]}})
    assert plan.scenario(3).vessel_sim.disturbance.earth_fixed.east_force == plan.values(1)[FORCE] < 3.0
    assert plan.scenario(3, {FORCE: 9.0}).vessel_sim.disturbance.earth_fixed.east_force == 9.0
    assert (plan.scenario(3).vessel_sim.seed, plan.scenario(3, {SEED: 3}).vessel_sim.seed) == (7, 3)
    both = campaign(tmp_path, set={"vessel_sim.duration": 0.5, SEED: 7}, draw={SEED: {"choice": [3, 4]}})
    assert {both.planned(run).seed for run in range(10)} <= {3, 4}
    assert [both.scenario(run).vessel_sim.seed for run in range(10)] == [both.planned(run).seed for run in range(10)]


@pytest.mark.parametrize(
    ("changes", "same"),
    [
        ({"runs": 9}, True),
        ({"seed": 2}, False),
        ({"chunk": 5}, False),
        ({"laws": LAWS[::-1]}, False),
        ({"laws": LAWS[:1]}, False),
        ({"limits": {"position_error_rms": 1.0}}, False),
        ({"set": {"vessel_sim.duration": 0.6}}, False),
        ({"draw": {X: {"normal": [5.0, 1.0]}}}, False),
        ({"sampling": "sobol"}, False),
    ],
)
def test_whatever_rows_depend_on_makes_another_campaign(tmp_path: Path, changes: dict[str, Any], same: bool) -> None:
    assert (campaign(tmp_path).digest == campaign(tmp_path, **changes).digest) == same


def test_another_scenario_of_the_same_name_and_other_code_of_a_law_make_another_campaign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = campaign(tmp_path)
    other = before.source._replace(scenario=before.source.scenario.replace("duration: ", "duration: 1"))
    assert other.scenario != before.source.scenario
    assert Campaign.parse(other, None).digest != before.digest
    monkeypatch.setattr("vessel_hsmc_ros.studies.campaign.plan.law_provenance", lambda law: {"law_sha256": law + "1"})
    assert campaign(tmp_path).digest != before.digest


@pytest.mark.parametrize(("runs", "chunk", "sizes"), [(5, 4, [4, 4, 2]), (4, 4, [4, 4]), (1, 4, [2]), (2, 1, [1] * 4)])
def test_the_files_hold_each_run_once(tmp_path: Path, runs: int, chunk: int, sizes: list[int]) -> None:
    plan = campaign(tmp_path, runs=runs, chunk=chunk)
    ranges = [plan.runs_of(number) for number in range(plan.chunks)]
    assert [len(each) for each in ranges] == sizes
    assert [run for each in ranges for run in each] == list(range(plan.runs))


def row(run: int, plan: Campaign, **more: object) -> dict[str, Any]:
    planned = plan.planned(run)
    metrics = dict.fromkeys(Metrics._fields, float(run))
    return {"run": run, "draw": planned.draw, "law": planned.law, "seed": planned.seed, **planned.values, **metrics, **more}


def filled(folder: Path, plan: Campaign, *chunks: int) -> Dataset:
    """The folder of a campaign with the rows of some of its files."""
    made = Dataset(folder)
    with opened(made, plan):
        for number in chunks:
            rows = [row(run, plan, failed=False, failure="", ended_early=False) for run in plan.runs_of(number)]
            write_file(made.chunk_path(number), write_table(rows, plan, number))
    return made


def test_missing_files_are_those_that_are_not_there_or_have_become_too_short(tmp_path: Path) -> None:
    plan = campaign(tmp_path)
    made = filled(tmp_path / "there", plan, 0, 2)
    assert list(made.missing(plan)) == [1]
    assert check_chunk(made.chunk_path(2), plan) == 2
    longer = campaign(tmp_path, runs=7)
    assert list(made.missing(longer)) == [1, 2, 3]
    with opened(made, longer):
        pass
    assert Campaign.of_folder(tmp_path / "there").runs == 14
    assert Campaign.of_folder(tmp_path / "there", 6).runs == 12
    assert read_rows(tmp_path / "there")["run"].to_pylist() == [0, 1, 2, 3, 8, 9]


def test_a_row_is_that_of_its_number_also_where_its_file_has_fewer_rows(tmp_path: Path) -> None:
    filled(tmp_path / "there", campaign(tmp_path), 0, 2)
    with opened(Dataset(tmp_path / "there"), campaign(tmp_path, runs=7)):
        pass
    found = {run: Row.read(tmp_path / "there", run).values.get("position_error_rms") for run in (0, 3, 4, 9, 10)}
    assert found == {0: 0.0, 3: 3.0, 4: None, 9: 9.0, 10: None}


@pytest.mark.parametrize("number", range(3))
def test_a_folder_whose_process_is_killed_while_it_is_made_is_completed_by_the_next_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    left = iter(range(number))

    def write(path: Path, content: bytes) -> None:
        if next(left, None) is None:
            raise KeyboardInterrupt
        write_file(path, content)

    plan = campaign(tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(datasets, "write_file", write)
        with pytest.raises(KeyboardInterrupt):
            filled(tmp_path / "there", plan)
    with pytest.raises(CampaignError, match="is not the folder of a campaign"):
        Campaign.of_folder(tmp_path / "there")
    with opened(Dataset(tmp_path / "there"), plan):
        pass
    assert Campaign.of_folder(tmp_path / "there").digest == plan.digest


def test_a_file_is_replaced_entirely_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"before")
    seen: list[bytes] = []

    def sync(_: int) -> None:
        seen.append(path.read_bytes())
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", sync)
    with pytest.raises(CampaignError, match="No space left"):
        write_file(path, b"after")
    assert (seen, path.read_bytes(), len(list(tmp_path.iterdir()))) == ([b"before"], b"before", 1)


def test_opening_a_folder_removes_what_was_half_written_and_no_rows(tmp_path: Path) -> None:
    made = filled(tmp_path / "there", campaign(tmp_path), 0, 1)
    (made.rows / ".chunk-00002.parquet.77").write_bytes(b"half")
    content = {path.name: path.read_bytes() for path in made.files()}
    with opened(made, campaign(tmp_path)):
        pass
    assert {path.name: path.read_bytes() for path in made.rows.iterdir()} == content


def about(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "campaign.json").read_text())
    return found


def test_the_number_of_draws_that_is_given_counts_more_than_that_of_a_folder_and_the_folder_has_it_from_then_on(
    tmp_path: Path,
) -> None:
    """The file has 5 draws of two laws; the folder was extended to 7."""
    filled(tmp_path / "there", campaign(tmp_path, runs=7), 0)
    for load in (Campaign.load, Campaign.of_folder):
        assert load(tmp_path / "there").draws == 7
        assert [load(tmp_path / "there", runs).draws for runs in (7, 9, 12)] == [7, 9, 12]
    extended = Campaign.load(tmp_path / "there", 9)
    assert (extended.runs, extended.digest) == (18, campaign(tmp_path).digest)
    with opened(Dataset(tmp_path / "there"), extended):
        assert Campaign.load(tmp_path / "there").draws == 9
    with (
        pytest.raises(CampaignError, match="has 9 draws already"),
        opened(Dataset(tmp_path / "there"), campaign(tmp_path, runs=8)),
    ):
        pass
    assert about(tmp_path / "there")["repetitions"] == 9


def test_a_folder_keeps_the_versions_that_its_first_rows_were_computed_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    filled(tmp_path / "there", campaign(tmp_path), 0)
    before = about(tmp_path / "there")
    monkeypatch.setattr(datasets, "versions", lambda: {**before["versions"], "numpy": "0.1"})
    with caplog.at_level(logging.WARNING):
        filled(tmp_path / "there", campaign(tmp_path, runs=7))
    assert f"numpy 0.1 instead of {before['versions']['numpy']}" in caplog.text
    assert about(tmp_path / "there") == {**before, "repetitions": 7, "draws": 7, "runs": 14}


@pytest.mark.parametrize("damage", [lambda data: data[:-9], lambda data: data[: len(data) // 2], lambda _: b""])
def test_a_cut_file_is_an_error_and_is_not_computed_over(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    made = filled(tmp_path / "there", campaign(tmp_path), 0)
    path = made.chunk_path(0)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(CampaignError, match="is cut or is not a Parquet file"):
        list(made.missing(campaign(tmp_path)))


VALUES: list[Any] = [1.0, 0.0, -0.0, math.nan, None, math.inf]


def test_a_metric_is_the_same_as_in_the_row_or_a_difference_whatever_it_is(tmp_path: Path) -> None:
    plan, name = campaign(tmp_path), Metrics._fields[0]
    metrics = Metrics(**dict.fromkeys(Metrics._fields, 1.0))
    for i, there in enumerate(VALUES):
        for j, here in enumerate(VALUES):
            read = Row(plan, 0, {**dict.fromkeys(Metrics._fields, 1.0), name: there, "ended_early": False, "failed": True})
            assert bool(read.differences(metrics._replace(**{name: here}))) == (i != j and {i, j} != {1, 2})


def test_another_seed_is_that_of_the_campaign_and_of_nothing_else(tmp_path: Path) -> None:
    fixed = campaign_file(tmp_path, set={"vessel_sim.duration": 0.5, SEED: 7})
    without = campaign_file(tmp_path, "without", seed=None)
    for seed in (0, 5):
        plan = Campaign.load(fixed, seed=seed)
        assert (plan.seed, plan.changes[SEED], plan.planned(0).seed) == (seed, 7, 7)
        assert Campaign.load(without, seed=seed).seed == seed
    assert (Campaign.load(fixed).seed, Campaign.load(without).seed) == (1, 0)


def test_a_smaller_number_of_draws_than_a_folder_has_is_refused_and_changes_nothing(tmp_path: Path) -> None:
    filled(tmp_path / "there", campaign(tmp_path), 0, 1)
    before = about(tmp_path / "there")
    with pytest.raises(CampaignError, match="has 5 draws already: give --runs with at least that number"):
        filled(tmp_path / "there", campaign(tmp_path, runs=4))
    assert about(tmp_path / "there") == before
    assert len(read_rows(tmp_path / "there")) == 8
