"""The options of real time of a node, as its process has them and as its log names them."""

import os
import re
from pathlib import Path
from typing import Any

import pytest

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters import ControlParameters

OPTIONS = "thread_priority 7 (SCHED_FIFO)", "lock_memory", "cpu_affinity [0]"

WITHOUT_PRIVILEGES = """
import ctypes, os, resource, sys
for capability in (14, 23):  # CAP_IPC_LOCK, CAP_SYS_NICE
    ctypes.CDLL(None).prctl(24, capability, 0, 0, 0)  # PR_CAPBSET_DROP: a program that is executed does not have it
resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, 0))
resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
"""
NODE = "-m", "vessel_hsmc_ros.nodes", "controller", "--ros-args"


def said(command: Any) -> str:
    """The line on the options, once the node has logged it."""
    return str(command.until(lambda: next((line for line in command.text.splitlines() if "real-time options" in line), ""), 60.0))


def given(**options: object) -> list[str]:
    return [part for name, value in options.items() for part in ("-p", f"real_time.{name}:={value}")]


def threads(pid: int) -> list[int]:
    return [int(path.name) for path in Path(f"/proc/{pid}/task").iterdir()]


def held(pid: int) -> tuple[bool, bool, bool]:
    """Whether a process has each of OPTIONS."""
    (locked,) = (line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmLck"))
    fifo = {os.sched_getscheduler(thread) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO for thread in threads(pid)}
    bound = {tuple(os.sched_getaffinity(thread)) == (0,) for thread in threads(pid)}
    assert len(fifo) == len(bound) == 1, "all threads alike"
    return fifo.pop(), int(locked.split()[1]) > 0, bound.pop()


def test_the_log_names_what_the_system_granted_and_every_thread_has_it(start: Any) -> None:
    command = start("python", *NODE, *given(thread_priority=7, lock_memory="true", cpu_affinity="[0]"))
    granted, _, refused = said(command).partition("refused")
    for option, has in zip(OPTIONS, held(command.popen.pid), strict=True):
        assert (option in granted, option in refused) == (has, not has)
    if held(command.popen.pid)[0]:
        assert {os.sched_getparam(thread).sched_priority for thread in threads(command.popen.pid)} == {7}


def test_what_is_refused_is_named_with_the_reason_and_the_remedy(start: Any) -> None:
    options = given(thread_priority=7, lock_memory="true", cpu_affinity="[0, 1000]")
    command = start("python", "-c", WITHOUT_PRIVILEGES, *NODE, *options)
    text = said(command)
    assert "[WARN]" in text
    assert "granted" not in text
    for reason in (
        "cpu_affinity [0, 1000] (bound to [0] only: there are",
        "lock_memory (Operation not permitted: give the process CAP_IPC_LOCK",
        "thread_priority 7 (SCHED_FIFO) (Operation not permitted: give the process CAP_SYS_NICE, or set LimitRTPRIO=7)",
    ):
        assert reason in text
    assert held(command.popen.pid) == (False, False, True)


def test_without_options_and_in_lockstep_the_process_stays_as_it_is(start: Any) -> None:
    command = start("python", *NODE, "-p", "lockstep:=true", *given(cpu_affinity="[0]"))
    command.until(lambda: "lockstep; publishes" in command.text, 60.0)
    assert "real_time.cpu_affinity is given and has no effect: lockstep is true" in command.text
    assert "real-time options" not in command.text
    assert os.sched_getaffinity(command.popen.pid) == os.sched_getaffinity(0)


def test_a_value_out_of_range_ends_the_start_with_name_value_and_range(start: Any) -> None:
    command = start("python", *NODE, *given(thread_priority=100))
    assert command.wait(60.0) == 2
    assert "real_time.thread_priority must be an integer from 0 to 99 (got 100)" in command.text


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("thread_priority", -1, "an integer from 0 to 99 (got -1)"),
        ("lock_memory", 1, "true or false (got 1)"),
        ("cpu_affinity", [0, -2], "a list of integers from -1 to 1023 (got [0, -2])"),
        ("cpu_affinity", [0.5], "a list of integers from -1 to 1023 (got [0.5])"),
        ("cpu_affinity", 1, "a list of integers from -1 to 1023 (got 1)"),
    ],
)
def test_other_values_that_are_not_allowed(name: str, value: object, allowed: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(f"controller.real_time.{name} must be {allowed}")):
        schema.build(ControlParameters, {f"real_time.{name}": value}, "controller")
