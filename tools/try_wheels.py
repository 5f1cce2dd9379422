"""Installs the wheels of dist/ into an empty environment (docs/installing.md), and runs them where no compiler is to be found.

    .venv/bin/python tools/try_wheels.py

The libraries are those of requirements.lock, so that the outcome depends on the wheels only.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import messages
from install import LOCK

DEADLINE = 900.0
"""For each command, s."""

OURS = ("LD_LIBRARY_PATH", "PYTHONPATH", "VIRTUAL_ENV", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
"""Variables by which an environment would reach another one."""


def main() -> int:
    """Install, and run a scenario and the demo; the exit code is that of the first command that fails."""
    packages = [str(messages.fitting()), f"{next(messages.DIST.glob('vessel_hsmc_ros-*.whl'))}[ros]"]
    with tempfile.TemporaryDirectory() as folder:
        environment, constraints = Path(folder) / "environment", Path(folder) / "constraints.txt"
        constraints.write_text("\n".join(pins()), encoding="utf-8")
        executable = str(environment / "bin" / "vessel-hsmc")
        commands = (
            [sys.executable, "-m", "venv", str(environment)],
            [str(environment / "bin" / "python"), "-m", "pip", "install", "-qq", "-c", str(constraints), *packages],
            [executable, "run", "case2_tracking", "--set", "vessel_sim.duration=2"],
            [executable, "demo"],
        )
        for command in commands:
            started = time.monotonic()
            print("$", *(Path(command[0]).name, *command[1:]), flush=True)
            # Nothing of this environment: as after a login on a machine with Python only.
            variables = {name: value for name, value in os.environ.items() if name not in OURS} | {
                "PATH": str(environment / "bin")
            }
            done = subprocess.run(command, cwd=folder, env=variables, timeout=DEADLINE, check=False)
            if done.returncode:
                return done.returncode
            print(f"{time.monotonic() - started:.0f} s", flush=True)
    return 0


def pins() -> list[str]:
    """The versions of requirements.lock without their hashes; of what builds messages, none is installed."""
    return re.findall(r"^[a-z0-9.-]+==[^\\\n]*", LOCK.read_text(encoding="utf-8"), re.MULTILINE)


if __name__ == "__main__":
    sys.exit(main())
