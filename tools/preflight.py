"""What the set-up needs of this machine, checked before anything is downloaded.

    python3 tools/preflight.py

Prints one line for each thing that is missing, with the command that provides it; the exit code is 1 if there are any. It needs
only the standard library, of any Python 3.
"""

from __future__ import annotations

import os
import platform
import shutil
import sys
import sysconfig
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OLDEST, NEWEST = (3, 10), (3, 13)
"""Versions of Python for which there are wheels of rclpy."""

GLIBC = (2, 28)
"""The oldest C library for which there are wheels of rclpy."""

DISK = 1.6
"""What the environment takes, the messages compiled, GB (10^9 bytes)."""


def main() -> int:
    """Print what is missing."""
    found = problems()
    for line in found:
        sys.stderr.write(f"error: {line}\n")
    return 1 if found else 0


def problems() -> list[str]:
    """One line for each thing that is missing; of Python or the processor only that, since all else depends on it."""
    if found := interpreter() or machine():
        return [found]
    compiling = not has_message_wheel()
    checks = [virtual_environments(), disk(ROOT), *([compiler(), headers(), folder(str(ROOT))] if compiling else [])]
    return [line for line in checks if line]


def interpreter(version: tuple[int, ...] = sys.version_info[:2], free_threaded: bool | None = None) -> str:
    """Why this Python cannot be used; empty if it can.

    Args:
        version: Major and minor number.
        free_threaded: Whether it is built without the global lock; by default as this one is.
    """
    shown = ".".join(map(str, version))
    other = "choose another one with `make PYTHON=python3.12 demo`"
    if not OLDEST <= version <= NEWEST:
        return f"Python {shown} is not supported: it must be {OLDEST[0]}.{OLDEST[1]} to {NEWEST[0]}.{NEWEST[1]}; {other}"
    if platform.python_implementation() != "CPython":
        return f"{platform.python_implementation()} is not supported: it must be CPython; {other}"
    if bool(sysconfig.get_config_var("Py_GIL_DISABLED")) if free_threaded is None else free_threaded:
        return f"the free-threaded Python {shown} is not supported: there is no rclpy for it; {other}"
    return ""


def machine(system: str = platform.system(), processor: str = platform.machine(), libc: tuple[str, str] | None = None) -> str:
    """Why ROS has no wheels for this machine; empty if it has.

    Args:
        system: Name of the operating system.
        processor: Name of the processor's architecture.
        libc: Name and version of the C library; by default those of this Python.
    """
    name, version = platform.libc_ver() if libc is None else libc
    workspace = 'use a ROS 2 Jazzy workspace (docs/installing.md, "In a Jazzy workspace")'
    if (system, processor) != ("Linux", "x86_64") or sys.maxsize < 2**32:
        return f"{system} on {processor} is not supported: rclpy has wheels for 64-bit Linux on x86_64; {workspace}"
    if name != "glibc":
        return f"the C library of this Linux is not glibc, for which rclpy has wheels (Alpine has musl); {workspace}"
    if tuple(map(int, version.split(".")[:2])) < GLIBC:
        return f"glibc {version} is too old: rclpy needs {GLIBC[0]}.{GLIBC[1]} or later, such as Debian 12 or Ubuntu 22.04 have"
    return ""


def virtual_environments() -> str:
    """Whether Python can create an environment with pip; Debian has the modules in a package of their own."""
    missing = [name for name in ("venv", "ensurepip") if find_spec(name) is None]
    return f"Python lacks {' and '.join(missing)}: sudo apt install {versioned('venv')}" if missing else ""


def compiler() -> str:
    """Whether there is a C++ compiler for the messages."""
    chosen = os.environ.get("CXX", "").split()[:1]
    if any(map(shutil.which, chosen or ["c++", "g++", "clang++"])):
        return ""
    return f"there is no C++ compiler{' ' + chosen[0] if chosen else ''}, which the messages need: sudo apt install g++"


def headers() -> str:
    """Whether there are the headers of Python for the messages."""
    file = Path(sysconfig.get_path("include")) / "Python.h"
    return "" if file.is_file() else f"there is no {file}, which the messages need: sudo apt install {versioned('dev')}"


def folder(path: str) -> str:
    """Whether the tools that generate the messages cope with the path of this folder."""
    if path.isascii() and not any(character.isspace() or character in "\"'$;&()" for character in path):
        return ""
    return f"the messages can be compiled only in a path of ASCII letters without spaces, not in {path}: move the folder"


def disk(path: Path) -> str:
    """Whether there is space for the environment, unless there is one already."""
    free = shutil.disk_usage(path).free / 1e9
    if free >= DISK or (path / ".venv" / ".package").exists():
        return ""
    return f"{free:.1f} GB are free in {path}, the environment needs {DISK:g} GB: free some, or clone to another disk"


def has_message_wheel() -> bool:
    """Whether dist/ has the messages compiled for this Python."""
    import messages  # its syntax is that of the supported versions

    return messages.fitting() is not None


def versioned(kind: str) -> str:
    """Debian's package of this Python, such as python3.11-dev."""
    return f"python{sys.version_info[0]}.{sys.version_info[1]}-{kind}"


if __name__ == "__main__":
    sys.exit(main())
