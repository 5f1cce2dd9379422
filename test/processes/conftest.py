"""The executables, started as a user would, each with a deadline."""

import pytest
from harness import BIN, Command


@pytest.fixture
def start(tmp_path):
    """Start a command in a folder of the test's own; whatever is left of it afterwards is killed."""
    commands = []

    def starter(*arguments, environment=None):
        folder = tmp_path / f"command{len(commands)}"
        folder.mkdir()
        program = BIN / arguments[0] if isinstance(arguments[0], str) else arguments[0]
        commands.append(Command([program, *arguments[1:]], folder, environment or {}))
        return commands[-1]

    yield starter
    for command in commands:
        if command.popen.poll() is None:
            command.kill()
