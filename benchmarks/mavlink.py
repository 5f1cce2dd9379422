"""MAVProxy as a foreign ground station between an autopilot and mavlink_node: it routes, and takes over; measured is how soon.

The autopilot is test/support/mavlink_autopilot.py, plain pymavlink. MAVProxy (`pip install MAVProxy`, in an environment of its
own) sends its packets on to the node; its command `mode HOLD` reaches the autopilot, whose heartbeat then reaches the node. The
time counts from the heartbeat of the autopilot to the state of the controller that shows standby.

    python benchmarks/mavlink.py [--repeats 20] [--mavproxy PATH]

Without MAVProxy the autopilot sends to the node directly and changes its mode by itself.
"""

import argparse
import shlex
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from std_srvs.srv import SetBool
from vessel_hsmc_msgs.msg import ControlState

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "test" / "support"), str(ROOT)]

from mavlink_autopilot import HOLD, MANUAL, Autopilot  # noqa: E402 - after the path to it
from sockets import free_port  # noqa: E402

from benchmarks.boats import SHIP, call, program, start  # noqa: E402
from vessel_hsmc_ros.boats.parameters import commands, interfaces  # noqa: E402

AT_REST = (0.0,) * 6
DEADLINE = 30.0


class Measured(Autopilot):
    """An autopilot that runs in a thread of its own, and notes when it has left MANUAL."""

    left = 0.0

    def change(self, **values: Any) -> None:
        """Note the time of the heartbeat that reports HOLD."""
        super().change(**values)
        if self.mode == HOLD:
            self.left = time.monotonic()

    def run(self, ended: threading.Event) -> None:
        """Work until the event."""
        while not ended.wait(0.002):
            self.receive()
            self.step(0.0, 0.0)
            self.report(AT_REST)


def main() -> int:
    """Measure takeovers and print their times."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--mavproxy", default=shutil.which("mavproxy.py"), help="its program")
    arguments = parser.parse_args()
    port, through = free_port(), free_port()
    autopilot = Measured(f"udpout:127.0.0.1:{through if arguments.mavproxy else port}")
    ended = threading.Event()
    thread = threading.Thread(target=autopilot.run, args=(ended,), daemon=True)
    thread.start()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        running = nodes(folder, port)
        proxy = mavproxy(arguments.mavproxy, through, port, folder) if arguments.mavproxy else None
        try:
            times = takeovers(autopilot, proxy, arguments.repeats)
        finally:
            for process in running:
                process.terminate()
                process.wait(20.0)
            if proxy:
                proxy.kill()  # it stays on SIGTERM
                proxy.wait(20.0)
            ended.set()
            thread.join()
    way, middle = "by MAVProxy" if proxy else "by the autopilot", sorted(times)[len(times) // 2]
    print(f"{len(times)} takeovers {way}: standby after {max(times) * 1e3:.0f} ms at most, median {middle * 1e3:.0f} ms")
    return 0


def nodes(folder: Path, port: int) -> list["subprocess.Popen[bytes]"]:
    """Start the nodes by the commands of docs/boats.md."""
    call(folder, "init", "boat", *SHIP, "--interface", "mavlink", "--no-check")
    connection = folder / "boat_mavlink.yaml"
    section = "/**/mavlink:\n  ros__parameters: {"
    connection.write_text(connection.read_text().replace(section, f"{section}connection: 'udpin:127.0.0.1:{port}', "))
    lines = [program(shlex.split(line)) for line in commands(interfaces()["mavlink"], "boat")]
    return [start(folder, line, folder / f"{k}.txt") for k, line in enumerate(lines)]


def mavproxy(path: str, master: int, out: int, folder: Path) -> "subprocess.Popen[bytes]":
    """Start MAVProxy between the autopilot and the node; its console takes commands."""
    command = [path, f"--master=udpin:127.0.0.1:{master}", f"--out=udp:127.0.0.1:{out}", "--default-modules=mode,link,output"]
    with (folder / "mavproxy.txt").open("wb") as output:
        return subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stdout=output, stderr=subprocess.STDOUT)


def takeovers(autopilot: Measured, proxy: Any, repeats: int) -> list[float]:
    """The times from a change of mode to standby, s."""
    rclpy.init()
    probe = rclpy.create_node("probe")
    operation, seen = [ControlState.STANDBY], [0.0]

    def take(message: ControlState) -> None:
        if message.operation != operation[0]:
            operation[0], seen[0] = message.operation, time.monotonic()

    probe.create_subscription(ControlState, "controller/state", take, 10)
    enable = probe.create_client(SetBool, "controller/enable")

    def until(condition: Callable[[], Any]) -> None:
        end = time.monotonic() + DEADLINE
        while not condition():
            rclpy.spin_once(probe, timeout_sec=0.01)
            if time.monotonic() > end:
                raise SystemExit("the condition was not met in time")

    until(enable.service_is_ready)
    times = []
    for _ in range(repeats):
        autopilot.change(mode=MANUAL)

        def enabled() -> bool:
            enable.call_async(SetBool.Request(data=True))
            pause = time.monotonic() + 0.3
            until(lambda: time.monotonic() > pause)
            return operation[0] != ControlState.STANDBY

        until(enabled)
        autopilot.left = 0.0
        if proxy:
            proxy.stdin.write(b"mode HOLD\n")
            proxy.stdin.flush()
        else:
            autopilot.change(mode=HOLD)
        until(lambda: operation[0] == ControlState.STANDBY)
        times.append(seen[0] - autopilot.left)
    rclpy.shutdown()
    return times


if __name__ == "__main__":
    sys.exit(main())
