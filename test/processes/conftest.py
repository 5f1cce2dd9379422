"""The executables, started as a user would, each with a deadline."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from harness import Command, executable


@pytest.fixture(autouse=True)
def _installed() -> None:
    """Skip the tests of the command where it is not installed."""
    executable("vessel-hsmc")


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Command]]:
    """Start a command in a folder of the test's own; if it still runs after the test, it is killed."""
    commands: list[Command] = []

    def starter(program: str | Path, *arguments: object, environment: Mapping[str, str] | None = None) -> Command:
        folder = tmp_path / f"command{len(commands)}"
        folder.mkdir()
        path = executable(program) if isinstance(program, str) else program
        commands.append(Command([path, *arguments], folder, environment or {}))
        return commands[-1]

    yield starter
    for command in commands:
        if command.popen.poll() is None:
            command.kill()
