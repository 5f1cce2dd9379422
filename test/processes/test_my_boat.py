"""The example of a boat of one's own, which the reference and the controller node steer."""

import re
import signal
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest
from harness import Command, children

from vessel_hsmc_ros.core.install_paths import share_directory

EXAMPLE = share_directory() / "examples" / "my_boat.py"
LAUNCH_TEST = EXAMPLE.with_name("test_boat_launch.py")
REPORT = re.compile(r"boat at (\S+) (\S+), (\S+) m from the reference")


@pytest.mark.long
@pytest.mark.skipif(not EXAMPLE.exists(), reason="the examples are part of the source tree only")
def test_the_boat_of_the_example_follows_its_reference(start: Callable[..., Command]) -> None:
    command = start("python", EXAMPLE)

    def latest() -> tuple[float, ...]:
        found = REPORT.findall(command.text)
        return tuple(map(float, found[-1])) if found else (0.0, 0.0, 0.0)

    # On a busy machine it may be farther away for a moment.
    command.until(lambda: latest()[0] > 4.0 and latest()[2] < 0.5)
    nodes = children(command.popen.pid)
    assert len(nodes) == 2
    command.popen.send_signal(signal.SIGINT)
    assert command.wait() == 0
    assert "Traceback" not in command.text
    assert not [pid for pid in nodes if Path(f"/proc/{pid}").exists()]


@pytest.mark.long
@pytest.mark.skipif(not LAUNCH_TEST.exists(), reason="the examples are part of the source tree only")
def test_the_launch_test_of_the_example_passes_and_is_skipped_with_a_reason_without_launch(start: Callable[..., Command]) -> None:
    command = start("python", "-m", "pytest", "-rs", LAUNCH_TEST)
    code = command.wait(200.0)
    if find_spec("launch_testing") and find_spec("launch_ros"):
        assert (code, "1 passed" in command.text) == (0, True), command.text
    else:
        assert "launch_testing comes with a ROS install only" in command.text
        assert "1 skipped" in command.text
