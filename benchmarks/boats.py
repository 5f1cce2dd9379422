"""Boats of foreign stacks, steered along a survey path through each interface of docs/boats.md, in real time.

The boat is test/support/foreign_boat.py, plain rclpy and pymavlink without code of the package, with the types, quality of
service, rates and frames of the stack; the nodes are started by the commands of the page. A row beside them has odometry of 5 to
20 Hz at random intervals, best effort, of which 10 % are lost.

    python benchmarks/boats.py [--seconds 110] [--folder FOLDER] [STACK ...]
"""

import argparse
import math
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from rich.console import Console
from rich.table import Table

from vessel_hsmc_ros.boats.parameters import commands, interfaces

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "test" / "support"))

import definitions  # noqa: E402

EMPTY: Mapping[str, str] = {}
BOAT = ROOT / "test" / "support" / "foreign_boat.py"
SHIP = ["--length", "5", "--mass", "520", "--surge-force-limit", "300", "--yaw-moment-limit", "250", "--speed", "2"]
THRUSTERS = ["--thruster=-1.5,0.8,150,150", "--thruster=-1.5,-0.8,150,150"]
LEGS = "x,y\n0,0\n20,0\n20,8\n0,8\n0,16\n20,16\n"
READY = 90.0
"""Longest time in which nodes and boat are ready, s."""

SETTLED = 10.0
"""Time after enabling from which errors count, s."""

MOUNTED = "antenna: [1.0, 0.0], datum: [59.9, 10.7]"
"""Place of the antenna of the foreign boat, and its origin."""

RECEIVER = 0.01
"""Standard deviation declared for its receiver, m, which is without noise."""

NATIVE = "robot_localization"
STACKS: dict[str, tuple[str, list[str]]] = {
    NATIVE: (NATIVE, ["--rate", "50", "50"]),
    "5 to 20 Hz, 10 % lost": (NATIVE, ["--best-effort", "--rate", "5", "20", "--loss", "0.1"]),
    "mavros": ("mavros", ["--frame", "map", "--best-effort", "--rate", "28", "32", "--command", "cmd_vel"]),
    "ardupilot_dds": (
        "ardupilot_dds",
        shlex.split("--state pose_twist --frame base_link --twist parent --best-effort --rate 28 32 --command cmd_vel"),
    ),
    "mavlink": ("mavlink", ["--state", "mavlink", "--command", "mavlink"]),
    "px4": ("px4", ["--state", "px4", "--command", "px4"]),
    "otter": ("otter", ["--state", "otter", "--rate", "9", "11", "--command", "otter"]),
    "vrx": ("vrx", ["--state", "navsat", "--rate", "19", "21", "--command", "thrusters"]),
    "pwm": ("pwm", ["--rate", "50", "50", "--command", "pwm"]),
    "heron": ("heron", ["--rate", "28", "32", "--command", "twist"]),
}
"""The stack and the arguments of the foreign boat, by row."""

REPORT = re.compile(r"t (\S+) at (\S+) (\S+), (\S+) m from the reference")


def main() -> int:
    """Run the stacks one after the other and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stacks", nargs="*", default=list(STACKS), help="all by default")
    parser.add_argument("--seconds", type=float, default=110.0, help="length of a run, s")
    parser.add_argument("--folder", type=Path, help="keep the files and what the programs print in it")
    arguments = parser.parse_args()
    table = Table("stack", "rms error [m]", "largest [m]", "times native")
    rms: dict[str, float] = {}
    for name in arguments.stacks:
        errors = run(
            *STACKS[name], arguments.seconds, arguments.folder and arguments.folder / name.partition(",")[0].replace(" ", "_")
        )
        rms[name] = math.sqrt(sum(e * e for e in errors) / len(errors))
        ratio = f"{rms[name] / rms[NATIVE]:.2f}" if NATIVE in rms else ""
        table.add_row(name, f"{rms[name]:.3f}", f"{max(errors):.3f}", ratio)
        print(f"{name}: {rms[name]:.3f} m rms, {max(errors):.3f} m at most, {len(errors)} samples", flush=True)
    Console().print(table)
    return 0


def run(stack: str, boat: list[str], seconds: float, kept: Path | None = None) -> list[float]:
    """Distances of a boat from its reference, one a second, m; its files are kept in a folder if one is given."""
    with tempfile.TemporaryDirectory() as name:
        folder = kept or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        by_thrusters = THRUSTERS if "thruster_allocation" in interfaces()[stack].nodes else []
        call(folder, "init", "boat", *SHIP, *by_thrusters, "--interface", stack, "--no-check")
        (folder / "legs.csv").write_text(LEGS)
        connection = folder / f"boat_{stack}.yaml"  # what the page has a person write into it
        text = connection.read_text().replace("heading: imu_euler", f"heading: imu_euler, {MOUNTED}")
        text = text.replace("antenna: [-0.85, 0.0]", MOUNTED.replace(", datum", "\n    datum"))
        text = text.replace("position_noise: 0.05", f"position_noise: {RECEIVER}")
        connection.write_text(text.replace("curve_thrusts: [-30.0, 40.0]", "curve_thrusts: [-150.0, 150.0]"))
        output = folder / "boat.txt"
        remaps = [f"{own}:={other}" for topics in interfaces()[stack].nodes.values() for own, other in topics.items()]
        ros = ["--ros-args", *(word for remap in remaps for word in ("-r", remap))]
        nodes = [program(shlex.split(line)) for line in commands(interfaces()[stack], "boat")]
        messages = definitions.environment("px4_msgs") if stack == "px4" else {}
        running = [start(folder, command, folder / f"{k}.txt", messages or {}) for k, command in enumerate(nodes)]
        running.append(start(folder, [sys.executable, str(BOAT), *boat, *ros], output))
        try:
            wait_for(lambda: bool(REPORT.search(output.read_text())), READY)
            enable(folder)
            began = len(REPORT.findall(output.read_text()))
            call(folder, "path", "legs.csv")
            time.sleep(seconds)
            return [float(found[3]) for found in REPORT.findall(output.read_text())][began + round(SETTLED) :]
        finally:
            for process in running:
                process.send_signal(signal.SIGINT)
            for process in running:
                process.wait(40.0)  # a node ends by itself within 20 s, whatever the middleware does


def program(command: list[str]) -> list[str]:
    """A command of the page with the executable of this environment."""
    return [str(Path(sys.executable).parent / command[0]), *command[1:]]


def start(folder: Path, command: list[str], output: Path, variables: Mapping[str, str] = EMPTY) -> "subprocess.Popen[bytes]":
    """Start a process whose output goes to a file."""
    output.touch()
    environment = {"FASTRTPS_DEFAULT_PROFILES_FILE": str(ROOT / "config" / "fastdds.xml"), **os.environ, **variables}
    return subprocess.Popen(command, cwd=folder, stdout=output.open("wb"), stderr=subprocess.STDOUT, env=environment)


def call(folder: Path, *arguments: str) -> None:
    """Run the command `vessel-hsmc`."""
    command = [sys.executable, "-m", "vessel_hsmc_ros.cli.main", *arguments]
    subprocess.run(command, cwd=folder, check=True, timeout=60.0, capture_output=True)


def enable(folder: Path) -> None:
    """Enable the controller as soon as it is ready."""

    def done() -> bool:
        try:
            call(folder, "call", "enable")
        except subprocess.CalledProcessError:
            return False
        return True

    wait_for(done, READY)


def wait_for(condition: Callable[[], bool], limit: float) -> None:
    """Wait until a condition holds.

    Raises:
        TimeoutError: it does not within the limit, s.
    """
    end = time.monotonic() + limit
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the boat or the controller was not ready in time")
        time.sleep(0.2)


if __name__ == "__main__":
    sys.exit(main())
