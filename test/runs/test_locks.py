"""Runs on one machine exclude each other where their nodes would mix."""

import multiprocessing
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest

from vessel_hsmc_ros.core.exceptions import RunError

supervisor = pytest.importorskip("vessel_hsmc_ros.runs.supervisor", reason="ROS is not installed")

RUNS = 4


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)


def refused(namespace: str, lockstep: bool) -> str:
    """The reason for which a run is refused; empty if it is not."""
    try:
        with supervisor.exclusive(namespace, lockstep):
            return ""
    except RunError as error:
        return str(error)


@pytest.mark.parametrize(
    ("first", "second", "shared"),
    [
        (("", True), ("", True), "namespace /"),
        (("alpha", True), ("beta", True), "/clock"),
        (("alpha", False), ("alpha", False), "namespace /alpha"),
        (("alpha", True), ("alpha", False), "namespace /alpha"),
        (("alpha", False), ("beta", False), ""),
        (("alpha", False), ("beta", True), ""),
        (("clock", False), ("beta", True), ""),
    ],
)
def test_a_run_excludes_those_that_would_share_a_topic(first: tuple[str, bool], second: tuple[str, bool], shared: str) -> None:
    with supervisor.exclusive(*first):
        reason = refused(*second)
    assert shared in reason
    assert bool(reason) == bool(shared)
    assert not refused(*second), "the lock is kept after the run"


def compete(number: int, start: Barrier, done: Barrier) -> None:
    """Try to get the lock together with the others, and keep it until all have tried; exits with 1 without it."""
    start.wait(30.0)
    try:
        with supervisor.exclusive(f"vessel{number}", lockstep=True):
            done.wait(30.0)
    except RunError:
        done.wait(30.0)
        raise SystemExit(1) from None


def test_of_lockstep_runs_that_start_at_the_same_instant_exactly_one_is_accepted() -> None:
    context = multiprocessing.get_context("fork")
    for _ in range(10):
        start, done = context.Barrier(RUNS), context.Barrier(RUNS)
        processes = [context.Process(target=compete, args=(number, start, done)) for number in range(RUNS)]
        for process in processes:
            process.start()
        for process in processes:
            process.join(60.0)
        assert sorted(process.exitcode or 0 for process in processes) == [0, *[1] * (RUNS - 1)]
