"""The pool of worker processes: results, progress, errors and cancellation."""

import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.studies.batch import run_all

Progress = Callable[[float], None]


def square(task: float, progress: Progress) -> float:
    progress(task)
    return task * task


def work(task: tuple[str, Path], progress: Progress) -> str:
    """Fail, die, or run until cancelled."""
    kind, folder = task
    if kind == "fail":
        wait_for(folder / "running")
        raise ParameterError("this task fails")
    if kind == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    end = time.monotonic() + 60.0
    (folder / "running").touch()
    while time.monotonic() < end:
        try:
            progress(1.0)
        except RunError:
            (folder / "cancelled").touch()
            raise
        time.sleep(0.01)
    return "not cancelled"


def wait_for(path: Path) -> None:
    end = time.monotonic() + 30.0
    while not path.exists():
        assert time.monotonic() < end, f"{path} is missing"
        time.sleep(0.01)


@pytest.mark.long
@pytest.mark.parametrize("workers", [1, 2])
def test_results_have_the_order_of_the_tasks_and_progress_adds_up(workers: int) -> None:
    results: list[float] = []
    progress: list[float] = []
    assert run_all(square, [3.0, 1.0, 2.0], workers=workers, on_result=results.append, on_progress=progress.append) == [9, 1, 4]
    assert sorted(results) == [1, 4, 9]
    assert progress[-1] == 6.0
    assert progress == sorted(progress)


def test_without_tasks_there_are_no_results() -> None:
    assert run_all(square, []) == []


@pytest.mark.long
def test_the_error_of_a_task_cancels_the_others(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="this task fails"):
        run_all(work, [("long", tmp_path), ("fail", tmp_path)], workers=2)
    wait_for(tmp_path / "cancelled")


@pytest.mark.long
def test_a_killed_worker_is_an_error() -> None:
    with pytest.raises(RunError, match="a worker process has died"):
        run_all(work, [("die", Path()), ("die", Path())], workers=2)


@pytest.mark.long
def test_an_interrupt_cancels_all_tasks(tmp_path: Path) -> None:
    def interrupt() -> None:
        wait_for(tmp_path / "running")
        os.kill(os.getpid(), signal.SIGINT)

    sender = threading.Thread(target=interrupt)
    sender.start()
    tasks: list[Any] = [("long", tmp_path)] * 2
    with pytest.raises(KeyboardInterrupt):
        run_all(work, tasks, workers=2)
    sender.join(10.0)
    wait_for(tmp_path / "cancelled")
