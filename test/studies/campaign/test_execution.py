"""Computing a campaign: resumption, extension, workers, one process at a time."""

import fcntl
import shutil
from pathlib import Path
from typing import Any

import pytest
from campaigns import campaign_file
from click import UsageError
from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.command import cli, execute
from vessel_hsmc_ros.core.exceptions import CampaignError, ParameterError, RunError
from vessel_hsmc_ros.simulation.compilation import DISABLED
from vessel_hsmc_ros.studies.campaign.dataset import Dataset, read_rows
from vessel_hsmc_ros.studies.campaign.execute import run_campaign
from vessel_hsmc_ros.studies.campaign.plan import Campaign

pytest.importorskip("pyarrow")

SHORT: dict[str, Any] = {"set": {"vessel_sim.duration": 0.1}}


def vessel_hsmc(*arguments: object) -> Result:
    """Call the command in this process; its errors are raised."""
    return CliRunner().invoke(cli, [*map(str, arguments)], catch_exceptions=False, standalone_mode=False)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in Dataset(folder).files()}


def times(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in Dataset(folder).files()}


@pytest.fixture
def done(tmp_path: Path) -> Path:
    """The folder of a complete campaign of three chunks."""
    return run_campaign(campaign_file(tmp_path, **SHORT), tmp_path / "done", workers=1)


def test_only_missing_chunks_are_computed(done: Path) -> None:
    before, bytes_before = times(done), contents(done)
    Dataset(done).chunk_path(1).unlink()
    reports: list[tuple[float, int]] = []
    run_campaign(done, workers=1, on_progress=lambda runs, total: reports.append((runs, total)))
    assert contents(done) == bytes_before
    assert {name for name, time in times(done).items() if time != before[name]} == {"chunk-00001.parquet"}
    assert reports[0] == (6.0, 10)
    assert reports[-1] == (10.0, 10)
    assert [runs for runs, _ in reports] == sorted(runs for runs, _ in reports)


def test_an_interrupt_leaves_complete_chunks(tmp_path: Path) -> None:
    def interrupt(runs: float, _total: int) -> None:
        if runs > 5.0:
            raise KeyboardInterrupt

    file, folder = campaign_file(tmp_path, **SHORT), tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        run_campaign(file, folder, workers=1, on_progress=interrupt)
    assert read_rows(folder).column("run").to_pylist() == [0, 1, 2, 3]
    run_campaign(file, folder, workers=1)
    assert read_rows(folder).column("run").to_pylist() == list(range(10))


def test_a_larger_number_extends_a_campaign(done: Path, tmp_path: Path) -> None:
    before = times(done)
    run_campaign(tmp_path / "small.yaml", done, workers=1, runs=8)
    assert read_rows(done).column("run").to_pylist() == list(range(16))
    changed = {name for name, time in times(done).items() if before.get(name) != time}
    assert changed == {"chunk-00002.parquet", "chunk-00003.parquet"}  # the last one was not full
    other = run_campaign(tmp_path / "small.yaml", tmp_path / "other", workers=1, runs=8)
    assert contents(done) == contents(other)
    assert Campaign.load(done).draws == 8
    with pytest.raises(CampaignError, match="has 8 draws already: give --runs"):
        run_campaign(tmp_path / "small.yaml", done, workers=1)


@pytest.mark.long
def test_parallel_processes_write_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DISABLED, "1")  # a hundred steps take less time than the import of a compiler by each process
    file = campaign_file(tmp_path, **SHORT)
    serial, parallel = (run_campaign(file, tmp_path / str(count), workers=count) for count in (1, 2))
    assert contents(parallel) == contents(serial)


def test_remainders_of_a_killed_process_are_removed(done: Path) -> None:
    remainder = Dataset(done).rows / ".chunk-00001.parquet.4711"
    remainder.write_bytes(b"PAR1")
    run_campaign(done, workers=1)
    assert not remainder.exists()


def test_the_folder_has_one_process_at_a_time_which_keeps_the_file_that_it_is_writing(done: Path) -> None:
    begun = Dataset(done).rows / ".chunk-00001.parquet.4711"
    begun.write_bytes(b"PAR1")
    with (done / "campaign.lock").open("ab") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(CampaignError, match="another process computes the campaign in"):
            run_campaign(done, workers=1)
    assert begun.exists()


def test_the_folder_of_another_campaign_is_refused(done: Path, tmp_path: Path) -> None:
    other = campaign_file(tmp_path, "other", seed=2, **SHORT)
    with pytest.raises(CampaignError, match="belongs to another campaign than other: choose another --output"):
        run_campaign(other, done, workers=1)


def test_a_folder_with_other_files_is_refused_and_left_as_it_was(tmp_path: Path) -> None:
    file, folder = campaign_file(tmp_path, **SHORT), tmp_path / "full"
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(CampaignError, match="is not empty and not the folder of a campaign"):
        run_campaign(file, folder, workers=1)
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


def test_a_folder_can_be_moved_without_its_lock(done: Path, tmp_path: Path) -> None:
    moved = Path(shutil.move(done, tmp_path / "moved"))
    (moved / "campaign.lock").unlink()
    (tmp_path / "small.yaml").unlink()
    Dataset(moved).chunk_path(0).unlink()
    run_campaign(moved, workers=1)
    assert read_rows(moved).num_rows == 10


def test_the_verb_computes_a_file_into_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    campaign_file(tmp_path, **SHORT)
    output = vessel_hsmc("campaign", "small.yaml", "--workers", "1", "--runs", "2").output
    assert "4 runs: runs/small_campaign" in output
    assert read_rows(tmp_path / "runs" / "small_campaign").num_rows == 4
    vessel_hsmc("campaign", "runs/small_campaign", "--workers", "1")


def test_a_row_is_repeated_offline_by_its_number(done: Path, tmp_path: Path) -> None:
    ended = vessel_hsmc("simulate", "--campaign", done, "--run", "5", "--no-bag", "--no-page", "--output", tmp_path / "runs")
    assert "all metrics are bit-identical to those of row 5 of the campaign" in ended.output
    assert ended.exit_code == 0


ROW = ["--campaign", "x", "--run", "3"]


@pytest.mark.parametrize(
    ("verb", "arguments"),
    [(verb, arguments)
     for verb in ("simulate", "run")
     for arguments in ([], ROW[:2], ROW[2:], ["case2_tracking", *ROW], [*ROW, "--set", "controller.law=guided"])]
    + [("run", [*ROW, "--real-time"]), ("run", [*ROW, "--faults", "x"])],
)  # fmt: skip
def test_a_row_takes_a_folder_and_a_number_and_nothing_else(verb: str, arguments: list[str]) -> None:
    with pytest.raises(UsageError, match="--campaign and --run"):
        vessel_hsmc(verb, *arguments)


@pytest.mark.parametrize("address", ["foo", "127.0.0.1:8786", "tcp://host"])
def test_a_scheduler_without_a_complete_address_is_refused(tmp_path: Path, address: str) -> None:
    with pytest.raises(ParameterError, match=f"--scheduler must be .*got {address}"):
        run_campaign(campaign_file(tmp_path), tmp_path / "out", scheduler=address)
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_a_scheduler_that_does_not_answer_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("vessel_hsmc_ros.studies.campaign.execute.CONNECT_LIMIT", 1.0)
    file = campaign_file(tmp_path, runs=1)
    arguments = ["campaign", file, "--output", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9"]
    monkeypatch.setattr("sys.argv", ["vessel-hsmc", *map(str, arguments)])
    assert execute() == 1
    (line,) = capsys.readouterr().err.splitlines()[-1:]
    assert line == "error: no Dask scheduler answers at tcp://127.0.0.1:9 within 1 s"


def test_a_file_system_that_refuses_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises((CampaignError, RunError), match="cannot be made"):
        run_campaign(campaign_file(tmp_path), tmp_path / "file" / "out")
