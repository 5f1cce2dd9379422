"""Commands that a plant applies when a node is killed or stopped: none may be older than its time-out.

python benchmarks/node_kills.py [--repeats 20] [--nodes controller,reference_ship,vessel_sim]

Every trial starts the nodes of case 2 in real time, in a namespace of its own, and sends SIGKILL or SIGSTOP, and SIGCONT after
STOPPED, to one of them at a random moment. The age of an applied wrench is its stamp minus that of the last command with the same
values; a step of the plant that was late may have a stamp before that of the command it takes.
"""

import argparse
import math
import os
import random
import signal
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import rclpy
from geometry_msgs.msg import WrenchStamped
from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.core.install_paths import PROFILES, discovery_profiles
from vessel_hsmc_ros.core.timing import NANOSECONDS, seconds
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.runs.processes import NodeGroup, alone
from vessel_hsmc_ros.scenario.run_folder import make_run_folder
from vessel_hsmc_ros.scenario.scenario import dump_scenario, for_nodes, load_scenario

NODES = ("controller", "reference_ship", "vessel_sim")
SIGNALS = {"SIGKILL": signal.SIGKILL, "SIGSTOP": signal.SIGSTOP}
TIMEOUT = 0.5
"""The plant's command_timeout, s."""

STOPPED = 2.0
"""Time for which a node is stopped, s; longer than every time-out."""

LIMIT = 90.0
"""Longest wait for the nodes to start or to recover, s."""

SLOW = 5.0
"""A recovery that takes longer, s, is shown with the logs of the nodes."""

SETTINGS = {"controller.law": "guided", "vessel_sim.command_timeout": TIMEOUT, "controller.safety.ramp_time": 0.5}


class Outcome(NamedTuple):
    """What a trial showed: the greatest age, the time until the wrench was zero and until a command was applied again, s."""

    age: float
    zero: float
    recovery: float


class Listener:
    """The commands and the applied wrenches of a namespace."""

    def __init__(self, namespace: str) -> None:
        self._node = rclpy.create_node("witness", namespace=namespace)
        self.commands: dict[tuple[float, float], list[int]] = defaultdict(list)
        self.applied: list[tuple[int, tuple[float, float]]] = []
        self._node.create_subscription(WrenchStamped, "cmd_wrench", self._on_command, qos.LOSSLESS)
        self._node.create_subscription(WrenchStamped, "applied_wrench", self._on_applied, qos.LOSSLESS)

    def _on_command(self, message: WrenchStamped) -> None:
        self.commands[conversions.read_wrench(message)].append(conversions.nanoseconds(message.header.stamp))

    def _on_applied(self, message: WrenchStamped) -> None:
        self.applied.append((conversions.nanoseconds(message.header.stamp), conversions.read_wrench(message)))

    def until(self, condition: Callable[[], bool], limit: float = LIMIT) -> float:
        """Listen until a condition holds; returns how long that took, s, or infinity after the limit."""
        began = time.monotonic()
        while not condition():
            if time.monotonic() > began + limit:
                return math.inf
            rclpy.spin_once(self._node, timeout_sec=0.02)
        return time.monotonic() - began

    def listen(self, seconds: float) -> None:
        """Listen for a time, s."""
        self.until(lambda: False, seconds)

    def drives(self) -> bool:
        """Whether a command is applied at present."""
        return bool(self.applied) and any(self.applied[-1][1])

    def greatest_age(self) -> float:
        """The greatest age of an applied command, s; infinite if no command equals an applied wrench."""
        known = min((stamps[0] for stamps in self.commands.values()), default=0) + round(TIMEOUT * NANOSECONDS)
        return max((self._age(at, wrench) for at, wrench in self.applied if any(wrench) and at > known), default=0.0)

    def _age(self, at: int, wrench: tuple[float, float]) -> float:
        given = [stamp for stamp in self.commands[wrench] if stamp <= at + round(TIMEOUT * NANOSECONDS)]
        return seconds(at - given[-1]) if given else math.inf

    def close(self) -> None:
        """Leave the namespace."""
        self._node.destroy_node()


def trial(folder: Path, node: str, name: str, seed: int) -> Outcome:
    """Run the nodes in a namespace of their own and send a signal to one of them.

    Args:
        folder: Folder for parameters and logs.
        node: Name of the node.
        name: Name of the signal.
        seed: Of the moment.
    """
    namespace = f"trial_{node}_{name.lower()}_{seed}"
    scenario = load_scenario("case2_tracking", {**for_nodes(False, True, namespace), **SETTINGS})
    run = make_run_folder(folder, namespace)
    run.write_parameters(dump_scenario(scenario.with_bag(run.bag.absolute(), run.parameters.absolute())))
    listener = Listener(namespace)
    with NodeGroup(run.parameters, run.logs, namespace, alone(NODES)) as group:
        if listener.until(listener.drives) == math.inf:
            raise RuntimeError(f"the nodes did not start within {LIMIT:g} s: {_logs(run.logs)}")
        listener.listen(random.Random(seed).uniform(0.5, 1.0))  # noqa: S311
        pid = next(each.popen.pid for each in group.processes if each.name == node)
        os.kill(pid, SIGNALS[name])
        outcome = _after(listener, node, name, pid)
        if outcome.zero == math.inf or outcome.recovery > SLOW:
            sys.stderr.write(_logs(run.logs))
    listener.listen(0.5)  # no applied wrench is compared without its command, which may be on its way
    outcome = outcome._replace(age=listener.greatest_age())
    listener.close()
    sys.stderr.write(f"{namespace}: {outcome}\n")
    return outcome


def _logs(folder: Path) -> str:
    """The last lines of each node's log."""
    return "\n".join(f"{log.stem}: {log.read_text()[-500:]}" for log in sorted(folder.iterdir()))


def _after(listener: Listener, node: str, name: str, pid: int) -> Outcome:
    """Listen to the consequences of a signal."""
    zero = math.nan if node == "vessel_sim" else listener.until(lambda: not listener.drives(), STOPPED)
    listener.listen(STOPPED - (zero if zero < STOPPED else 0.0))
    recovery = math.nan
    if name == "SIGSTOP":
        count = len(listener.applied)
        os.kill(pid, signal.SIGCONT)
        recovery = listener.until(lambda: len(listener.applied) > count and listener.drives())
    listener.listen(0.5)
    return Outcome(math.nan, zero, recovery)


def main() -> int:
    """Try every node and signal, print a table, and return 1 if a command was applied after its time-out."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=20, help="trials of each node and signal")
    parser.add_argument("--nodes", default=",".join(NODES), help="nodes to kill and stop")
    arguments = parser.parse_args()
    os.environ.setdefault(PROFILES, discovery_profiles())
    table = Table("node", "signal", "trials", "oldest command applied", "zero after, at most", "recovered after, at most")
    worst = 0.0
    rclpy.init(args=[])
    with tempfile.TemporaryDirectory() as folder:
        for node in arguments.nodes.split(","):
            for name in SIGNALS:
                outcomes = [trial(Path(folder), node, name, seed) for seed in range(arguments.repeats)]
                age, zero, recovery = (max(values) for values in zip(*outcomes, strict=True))
                worst = max(worst, age)
                table.add_row(node, name, str(len(outcomes)), *(f"{value:.3f} s" for value in (age, zero, recovery)))
                sys.stderr.write(f"{node} {name}: {age:.3f} s\n")
    rclpy.shutdown()
    Console().print(table)
    print(f"oldest command applied: {worst:.3f} s, time-out {TIMEOUT:g} s")
    return int(worst > TIMEOUT)


if __name__ == "__main__":
    sys.exit(main())
