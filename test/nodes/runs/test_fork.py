"""A group of nodes as a fork of the command: exit codes, signals, and where there is no fork."""

import signal
import subprocess
import sys

import pytest

from vessel_hsmc_ros.nodes.runs.processes import Fork

LIMIT = 30.0


def until_signal() -> int:
    signal.pause()
    return 0


def test_a_fork_has_the_exit_code_of_its_work() -> None:
    fork = Fork(["x"], lambda: 3)
    fork.wait(LIMIT)
    assert (fork.poll(), fork.returncode, fork.args) == (3, 3, ["x"])
    fork.send_signal(signal.SIGINT)  # it has ended: nothing is hit


def test_a_fork_is_waited_for_up_to_a_limit_and_ends_by_a_signal() -> None:
    fork = Fork(["x"], until_signal)
    assert fork.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        fork.wait(0.01)
    fork.send_signal(signal.SIGKILL)
    fork.wait(LIMIT)
    assert fork.returncode == -signal.SIGKILL


@pytest.mark.parametrize("user", ["contextlib.nullcontext([rclpy.init(), rclpy.create_node('before')])", "StatusListener()"])
def test_a_process_in_which_the_middleware_runs_is_not_forked_nor_after_a_run(user: str) -> None:
    program = f"""if True:
        import contextlib, numpy, rclpy
        from vessel_hsmc_ros.nodes.runs.processes import can_fork
        from vessel_hsmc_ros.nodes.runs.processes import StatusListener
        print(can_fork())
        with {user} as listener:
            print(can_fork())
        print(can_fork())
    """
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=LIMIT, check=True)
    assert answer.stdout.split() == ["True", "False", "False"]
