"""A run whose disk is full ends soon, with the error of the operating system, and leaves what was recorded readable."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from durations import rest_long
from harness import Command, exit_code, run_folder
from mounting import mounted

from vessel_hsmc_ros.bags.reader import open_bag

MEGABYTE = 1024 * 1024
NO_SPACE = "No space left on device"

Start = Callable[..., Command]


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of two megabytes; skips the test where mounting is not permitted."""
    with mounted(tmp_path / "disk", megabytes=2) as disk:
        yield disk


def fill(disk: Path) -> None:
    """Write a file until the disk is full."""
    with (disk / "filler").open("ab", buffering=0) as file:
        while shutil.disk_usage(disk).free:
            try:
                file.write(bytes(4096))
            except OSError:
                return


def last_log_line(folder: Path, process: str) -> str:
    return (folder / "logs" / f"{process}.log").read_text(encoding="utf-8").splitlines()[-1]


@pytest.mark.parametrize(("form", "process"), rest_long([("--composed", "node_group"), ("--processes", "recorder")]))
def test_a_disk_that_fills_up_during_a_run_is_named_with_the_path(
    start: Start, small_disk: Path, form: str, process: str
) -> None:
    command = start("vessel-hsmc", "run", "case2_tracking", form, "--output", small_disk)
    folder = command.until(lambda: run_folder(small_disk))
    assert folder
    bag = folder / "bag"
    recording = bag / "bag_0.mcap"
    command.until(lambda: recording.exists() and recording.stat().st_blocks * 512 > MEGABYTE // 2)
    fill(small_disk)
    assert command.wait() == 1
    reason = f"bag {bag} cannot be written: {NO_SPACE}"
    assert f"error: recorder failed: {reason}" in command.text
    assert last_log_line(folder, process).endswith(reason)
    assert "Traceback" not in command.text
    assert len(open_bag(bag).topics["/odom"].stamp) > 100


@pytest.mark.parametrize("arguments", [["run", "case2_tracking"], ["simulate", "case2_tracking"], ["compare", "case2_tracking"]])
def test_a_disk_that_is_full_from_the_start_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], small_disk: Path, arguments: list[str]
) -> None:
    fill(small_disk)
    monkeypatch.setattr("sys.argv", ["vessel-hsmc", *arguments, "--output", str(small_disk)])
    assert exit_code() == 1
    shown = capsys.readouterr()
    (line,) = (shown.out + shown.err).splitlines()
    assert line.startswith("error: ")
    assert line.endswith(NO_SPACE)
    assert str(small_disk) in line


@pytest.mark.long
def test_a_simulation_whose_bag_does_not_fit_reports_no_complete_bag(start: Start, small_disk: Path) -> None:
    command = start("vessel-hsmc", "simulate", "case2_tracking", "--output", small_disk)
    assert command.wait() == 1
    folder = run_folder(small_disk)
    assert folder
    assert f"error: bag {folder / 'bag'} cannot be written: {NO_SPACE}" in command.text
    assert "bag is complete" not in command.text
    assert f"vessel-hsmc recover {folder / 'bag'}" in command.text
