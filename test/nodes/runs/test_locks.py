"""Runs on one machine exclude each other where their nodes would mix."""

import multiprocessing
import os
from multiprocessing.synchronize import Barrier

import pytest

from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.studies import scenario_run

supervisor = pytest.importorskip("vessel_hsmc_ros.nodes.runs.supervisor", reason="ROS is not installed")

RUNS = 4


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


def refuse_as_another_user() -> None:
    """Exit with 0 if a run of another user is refused."""
    os.setuid(65534)
    raise SystemExit(0 if refused("", lockstep=True) else 1)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
def test_runs_of_two_users_exclude_each_other_as_their_domain_is_the_same() -> None:
    with supervisor.exclusive("", lockstep=True):
        process = multiprocessing.get_context("fork").Process(target=refuse_as_another_user)
        process.start()
        process.join(60.0)
    assert process.exitcode == 0


def test_a_long_namespace_does_not_count_as_one_in_use() -> None:
    assert not refused("/".join(["a_long_name_of_a_vessel"] * 10), lockstep=False)


def test_the_demonstration_takes_a_free_domain_unless_the_user_names_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    with scenario_run.free_domains(2) as (first, second):
        assert first != second
        with scenario_run.free_domains(1) as (third,):
            assert third not in (first, second)
    monkeypatch.setenv("ROS_DOMAIN_ID", first)
    with supervisor.exclusive("", lockstep=True):
        with pytest.raises(RunError, match=f"another run uses ROS domain {first} "), scenario_run.free_domains(2):
            pass
        monkeypatch.delenv("ROS_DOMAIN_ID")
        with scenario_run.free_domains(1) as (other,):
            assert other != first
