"""The rows of a campaign as Parquet files."""

import io
from dataclasses import replace
from pathlib import Path

import pytest
from campaigns import INERTIA, X, campaign, campaign_file

from vessel_hsmc_ros import simulate
from vessel_hsmc_ros.core.exceptions import CampaignError, ParameterError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.studies.campaign.dataset import Dataset, Row, read_rows
from vessel_hsmc_ros.studies.campaign.execute import exceeded, run_campaign, run_chunk
from vessel_hsmc_ros.studies.campaign.plan import Campaign

parquet = pytest.importorskip("pyarrow.parquet")

LIMITS = {"position_error_peak_last_quarter": 100.0, "settling_time": 1e3}
METRICS = Metrics(*range(10))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a complete small campaign; no test changes it."""
    path = tmp_path_factory.mktemp("campaign")
    return run_campaign(campaign_file(path, limits=LIMITS), path / "out", workers=1)


def test_a_chunk_is_the_same_bytes_whenever_it_is_computed(folder: Path) -> None:
    plan = Campaign.load(folder)
    assert run_chunk(plan, 1) == run_chunk(Campaign.load(folder), 1) == Dataset(folder).chunk_path(1).read_bytes()


def test_there_is_a_row_for_each_run_with_its_values_and_metrics(folder: Path) -> None:
    table, plan = read_rows(folder), Campaign.load(folder)
    assert table.column("run").to_pylist() == list(range(10))
    middle = ["failed", "failure", "ended_early"]
    assert table.column_names == ["run", "draw", "law", "seed", INERTIA, X, *middle, *Metrics._fields]
    row, planned, scenario = table.to_pylist()[7], plan.planned(7), plan.scenario(7)
    assert (row["draw"], row["law"], row["seed"]) == (planned.draw, planned.law, planned.seed)
    assert {name: row[name] for name in plan.drawn} == planned.values
    metrics = measured(simulate(scenario), scenario)
    assert metrics is not None
    assert {name: row[name] for name in Metrics._fields} == metrics._asdict()


def test_a_run_above_a_limit_is_a_failure_that_names_it(folder: Path) -> None:
    row = read_rows(folder).to_pylist()[0]
    assert (row["failed"], row["failure"], row["ended_early"]) == (True, "settling_time = none above 1000", False)


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ({}, ""),
        ({"position_error_rms_last_quarter": 1.0}, ""),
        ({"position_error_rms_last_quarter": 0.31}, "position_error_rms_last_quarter = 1 above 0.31"),
        ({"position_error_final": 1.0, "settling_time": 9.0}, "position_error_final = 2 above 1; settling_time = none above 9"),
        ({"heading_error_final_deg": 3.0}, "heading_error_final_deg = -4 above 3"),
        ({"yaw_moment_rms": 8.0}, "yaw_moment_rms = nan above 8"),
    ],
)
def test_limits_are_largest_magnitudes(limits: dict[str, float], text: str) -> None:
    metrics = METRICS._replace(heading_error_final_deg=-4.0, yaw_moment_rms=float("nan"))
    assert exceeded(metrics, limits) == text


def test_a_run_that_is_unstable_or_refused_is_a_row(tmp_path: Path) -> None:
    draw = {"controller.rate_hz": {"choice": [100.0, 30.0, 45.0]}}
    plan = campaign(tmp_path, runs=30, laws=["hierarchical_printed"], set={"vessel_sim.duration": 0.1}, draw=draw, chunk=30)
    rows = parquet.read_table(io.BytesIO(run_chunk(plan, 0))).to_pylist()
    by_rate = {row["controller.rate_hz"]: row for row in rows}
    assert not by_rate[100.0]["failed"]
    assert by_rate[100.0]["position_error_rms"] > 0.0
    for rate, reason in ((30.0, "does not fit"), (45.0, "does not fit")):
        row = by_rate[rate]
        assert reason in row["failure"]
        assert (row["failed"], row["ended_early"], row["position_error_rms"]) == (True, True, None)


def test_an_unfinished_campaign_has_the_rows_so_far(folder: Path, tmp_path: Path) -> None:
    copied = copy_of(folder, tmp_path)
    Dataset(copied).chunk_path(1).unlink()
    assert read_rows(copied).column("run").to_pylist() == [0, 1, 2, 3, 8, 9]
    assert list(Dataset(copied).missing(Campaign.load(copied))) == [1]


@pytest.mark.parametrize("size", [0, 3, 2000])
def test_a_cut_file_is_named_in_one_line(folder: Path, tmp_path: Path, size: int) -> None:
    copied = copy_of(folder, tmp_path)
    path = Dataset(copied).chunk_path(1)
    path.write_bytes(path.read_bytes()[:size])
    for use in (lambda: read_rows(copied), lambda: run_campaign(copied, workers=1)):
        with pytest.raises(CampaignError, match=r"chunk-00001.parquet is cut or is not a Parquet file: remove it") as error:
            use()
        assert "\n" not in str(error.value)


def test_a_damaged_file_is_named_in_one_line(folder: Path, tmp_path: Path) -> None:
    copied = copy_of(folder, tmp_path)
    path = Dataset(copied).chunk_path(1)
    content = bytearray(path.read_bytes())
    content[40] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(CampaignError, match=r"chunk-00001.parquet is damaged: remove it"):
        read_rows(copied)


def test_a_file_of_another_campaign_is_named_in_one_line(folder: Path, tmp_path: Path) -> None:
    copied = copy_of(folder, tmp_path)
    other = campaign(tmp_path, seed=2, limits=LIMITS)
    Dataset(copied).chunk_path(1).write_bytes(run_chunk(other, 1))
    for use in (lambda: read_rows(copied), lambda: run_campaign(copied, workers=1)):
        with pytest.raises(CampaignError, match=r"chunk-00001.parquet belongs to another campaign"):
            use()


def test_a_chunk_under_the_number_of_another_one_is_refused(folder: Path, tmp_path: Path) -> None:
    copied = copy_of(folder, tmp_path)
    Dataset(copied).chunk_path(1).write_bytes(Dataset(copied).chunk_path(0).read_bytes())
    with pytest.raises(CampaignError, match=r"chunk-00001.parquet belongs to another campaign"):
        read_rows(copied)


def test_a_folder_that_is_no_campaign_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="is not the folder of a campaign"):
        read_rows(tmp_path)
    with pytest.raises(CampaignError, match="is not the folder of a campaign"):
        read_rows(tmp_path / "nothing")


def test_a_run_is_compared_with_its_row(folder: Path) -> None:
    row = Row.read(folder, 3)
    metrics = Metrics(**{name: row.values[name] for name in Metrics._fields})
    assert row.differences(metrics) == []
    (line,) = row.differences(metrics._replace(position_error_rms=0.25))
    assert line.startswith("position_error_rms = ")
    assert line.endswith("in the row, 0.25 in the run")
    assert row.differences(None, "vessel_sim failed") == ["the row is complete; the run: vessel_sim failed"]
    early = replace(row, values={**row.values, "ended_early": True, "failure": "not finite"})
    assert early.differences(None, "vessel_sim failed: not finite") == []
    assert early.differences(metrics) == ["the row ended early: not finite; the run: complete"]


def test_a_row_that_is_not_computed_yet_has_a_scenario(folder: Path, tmp_path: Path) -> None:
    copied = copy_of(folder, tmp_path)
    Dataset(copied).chunk_path(0).unlink()
    row = Row.read(copied, 3)
    assert row.values == {}
    assert row.scenario().vessel_sim.lockstep
    with pytest.raises(ParameterError, match=r"run must be .*got 10"):
        Row.read(copied, 10)


def copy_of(folder: Path, parent: Path) -> Path:
    """A copy of the folder of a campaign, for a test that changes it."""
    import shutil

    return shutil.copytree(folder, parent / "copy")
