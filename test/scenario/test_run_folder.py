"""The files of a run folder: an older one stays until a new one is complete."""

import datetime
import json
import math
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.scenario.run_folder import RunFolder, file_name, make_run_folder, write_summary


@contextmanager
def files_end_at(size: int) -> Iterator[None]:
    """Let the operating system refuse what a file takes beyond a size in bytes, as a full disk does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_runs_that_start_in_the_same_second_have_a_folder_each(tmp_path: Path) -> None:
    folders = [make_run_folder(tmp_path / "runs", "circle").path for _ in range(5)]
    assert len(set(folders)) == 5
    assert all(folder.is_dir() for folder in folders)


def test_a_summary_or_parameters_that_do_not_fit_on_the_disk_leave_the_older_ones_as_they_are(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    folder.write_summary({"exit_code": 0})
    folder.write_parameters("a: 1\n")
    with files_end_at(100):
        with pytest.raises(RunError, match=r"run\.json cannot be written: File too large"):
            folder.write_summary({"exit_code": 1, "failure": "x" * 1000})
        with pytest.raises(RunError, match=r"params\.yaml cannot be written: File too large"):
            folder.write_parameters("a: 2\n" * 1000)
    assert folder.read_summary() == {"exit_code": 0}
    assert folder.parameters.read_text() == "a: 1\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["params.yaml", "run.json"]
    folder.write_summary({"exit_code": 1})
    assert folder.read_summary() == {"exit_code": 1}


def test_a_number_that_is_not_finite_is_null_in_a_summary(tmp_path: Path) -> None:
    """Of a run that has nearly diverged; JSON has no infinity, and most programs refuse one."""
    folder = RunFolder(tmp_path)
    folder.write_summary({"metrics": {"a": math.inf, "b": -math.inf, "c": 1e300}, "real_time_factor": math.nan, "code": 1})
    shown = json.loads(folder.summary.read_text(), parse_constant=pytest.fail)
    assert shown == {"metrics": {"a": None, "b": None, "c": 1e300}, "real_time_factor": None, "code": 1}
    assert folder.read_summary() == shown


@pytest.mark.parametrize("seconds", [0.75, 59.5, 1e5 + 0.25, 1e6])
def test_the_duration_of_a_run_has_its_fraction_and_all_of_its_days(tmp_path: Path, seconds: float) -> None:
    started = datetime.datetime.now(tz=datetime.timezone.utc) - datetime.timedelta(seconds=seconds)
    write_summary(RunFolder(tmp_path), {"started": started.isoformat(), "seed": 3}, 2, "a node was killed", {"metrics": 1})
    summary = RunFolder(tmp_path).read_summary()
    assert seconds <= summary.pop("duration") < seconds + 0.2
    assert summary == {"started": started.isoformat(), "seed": 3, "exit_code": 2, "failure": "a node was killed", "metrics": 1}


@pytest.mark.parametrize(("name", "readable"), [("böot 船", "böot_船"), ("a/b\\c:d*e", "a_b_c_d_e"), ("лодка-4.2", "лодка-4.2")])
def test_the_name_of_a_file_keeps_the_letters_of_every_script(name: str, readable: str) -> None:
    assert file_name(name) == readable
