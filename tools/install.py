"""Installs into the environment of the Python that runs it: by uv, which takes a sixth of pip's time, else by pip.

    .venv/bin/python tools/install.py TITLE ARGUMENTS...
    python3 tools/install.py --run TITLE COMMAND...

The title is shown while it works; the arguments are those of `pip install`, which uv understands as well. uv itself is installed
first, in the version of requirements.lock; where it cannot be, or cannot reach an index that pip is configured for, pip goes on.
With --run it only runs a command.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "requirements.lock"
OFFLINE = re.compile(
    r"name resolution|NameResolutionError|dns error|Connection refused|Network is unreachable|timed out|error sending request"
    r"|Failed to establish a new connection|ProxyError|SSLError|certificate",
    re.IGNORECASE,
)
"""What pip and uv write where the package index cannot be reached."""

SILENCE = 4.0
"""Longest time without a line where the output is no terminal, s."""

Command = list[str]


def main(title: str, arguments: Command) -> int:
    """Install by the first program that succeeds; else print the end of what the last one wrote, and the likely cause."""
    written = ""
    for program in (uv_command, pip_command):
        command = program()
        if not command:
            continue
        code, output = run(title, [*command, *arguments])
        if code == 0:
            return 0
        written += output
    sys.stderr.write("\n".join(written.splitlines()[-15:]) + "\n")
    if OFFLINE.search(written):
        sys.stderr.write(
            "error: the package index cannot be reached: check the network and HTTPS_PROXY, or name a mirror with PIP_INDEX_URL\n"
        )
    elif "No space left" in written:
        sys.stderr.write(f"error: the disk of {ROOT} or of the cache is full\n")
    return 1


def pip_command() -> Command:
    """The command of pip."""
    return [sys.executable, "-m", "pip", "install", "--disable-pip-version-check", "--progress-bar", "off"]


def uv_command() -> Command:
    """The command of uv; empty if there is none and none can be installed."""
    own = Path(sys.executable).parent / "uv"
    uv = str(own) if own.exists() else shutil.which("uv")
    if uv is None:
        with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
            file.write(pinned("uv"))
            file.flush()
            run("Installing uv", [*pip_command(), "--no-deps", "--requirement", file.name])
        uv = str(own) if own.exists() else None
    return [uv, "pip", "install", "--python", sys.executable, *cache()] if uv else []


def cache() -> Command:
    """Where uv keeps what it has downloaded: the user's cache, or this folder where that cannot be written."""
    given = os.environ.get("UV_CACHE_DIR")
    home = Path(given or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    existing = next(path for path in (home, *home.parents) if path.exists())
    return [] if given or os.access(existing, os.W_OK) else ["--cache-dir", str(ROOT / "build" / "uv")]


def pinned(name: str) -> str:
    """The lines of requirements.lock on a package."""
    found = re.search(rf"^{name}==(?:.*\\\n)*.*\n", LOCK.read_text(encoding="utf-8"), re.MULTILINE)
    return found[0] if found else name


def run(title: str, command: Command, environment: Mapping[str, str] | None = None) -> tuple[int, str]:
    """Run a command; a line grows by a dot every second, or lines follow each other, so that it does not look hung.

    Args:
        title: What is done.
        command: The command.
        environment: Its environment variables; by default those of this process.

    Returns:
        Its exit code, and what it wrote.
    """
    terminal, started = sys.stdout.isatty(), time.monotonic()
    show(f"{title} " if terminal else f"{title} ...\n")
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env=environment)
        while True:
            try:
                code = process.wait(1.0 if terminal else SILENCE)
                break
            except subprocess.TimeoutExpired:
                show("." if terminal else f"{title}: {time.monotonic() - started:.0f} s\n")
        log.seek(0)
        output = log.read()
    ended = f"{time.monotonic() - started:.0f} s" if code == 0 else "failed"
    show(f" {ended}\n" if terminal else f"{title}: {ended}\n")
    return code, output


def show(text: str) -> None:
    """Write to standard output at once."""
    sys.stdout.write(text)
    sys.stdout.flush()


def only_run(title: str, command: Command) -> int:
    """Run a command, and print what it wrote if it fails; its exit code."""
    code, output = run(title, command)
    sys.stderr.write(output if code else "")
    return code


if __name__ == "__main__":
    try:
        sys.exit(only_run(sys.argv[2], sys.argv[3:]) if sys.argv[1] == "--run" else main(sys.argv[1], sys.argv[2:]))
    except KeyboardInterrupt:
        sys.exit(130)
