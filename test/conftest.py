"""Each pytest process has a ROS domain of its own, nodes find each other fast, and each test has the mark of its kind."""

import faulthandler
import functools
import gc
import os
import signal
import sys
from collections.abc import Iterator
from importlib.abc import MetaPathFinder
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from vessel_hsmc_ros.core.install_paths import PROFILES, profiles_folder

if TYPE_CHECKING:
    from vessel_hsmc_ros.control.laws import Registry

ROOT = Path(__file__).resolve().parents[1]

sys.path.append(str(ROOT / "test" / "support"))  # where a process of a test imports this file, pytest has not done so
from collecting import pytest_pycollect_makemodule as pytest_pycollect_makemodule  # noqa: E402

os.environ.setdefault(PROFILES, str(profiles_folder() / "fastdds.xml"))  # on the local host only

# Before NumPy is imported: threads that multiply small matrices together spin, and take the cores from the other tests.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A shell without job control starts what runs in the background with SIGINT ignored, and what the tests start would inherit it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

if find_spec("hypothesis") is not None:
    from hypothesis import settings

    # The time that an example takes depends on the load of the machine.
    settings.register_profile("steady", deadline=None, max_examples=50)
    settings.load_profile("steady")


class SkipWithout(MetaPathFinder):
    """Skips a test module that imports a test library which is not installed, as may be in a colcon workspace."""

    LIBRARIES = ("hypothesis", "mcap_ros2", "sympy")

    def find_spec(self, fullname: str, *_: object) -> None:
        """The last finder to be called, when no other has found the module."""
        if fullname in self.LIBRARIES:
            pytest.skip(f"{fullname} is not installed", allow_module_level=True)


sys.meta_path.append(SkipWithout())


HUNG = 400.0
"""Time after which a test has hung, s: its process ends with the stacks of all threads, and another one takes the other tests."""

STDERR: list[int] = []
"""A copy of the standard error, which pytest takes over while a test runs."""


def pytest_configure() -> None:
    """Copy the standard error before any test runs."""
    STDERR.append(os.dup(2))


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol() -> Iterator[None]:
    """Bound the time of a test without Python's help, as it may hang in the middleware with the interpreter's lock."""
    faulthandler.dump_traceback_later(HUNG, exit=True, file=STDERR[0])
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.fixture(scope="session", autouse=True)
def ros_domain() -> Iterator[int | None]:
    """A domain that no other pytest process on this machine uses, set before any ROS context is made."""
    try:
        from domain_coordinator import domain_id
    except ModuleNotFoundError:  # only tests of nodes need it, and several pytest processes at a time
        yield None
        return
    with domain_id() as domain:
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        yield domain


@pytest.fixture
def laws() -> Iterator["Registry"]:
    """The registry of control laws; what a test adds is removed after it."""
    from vessel_hsmc_ros.control.laws import LAWS

    before = LAWS.others
    yield LAWS
    LAWS._others = dict(before)


@pytest.fixture(autouse=True)
def _process() -> Iterator[None]:
    """Leave the process as each test found it.

    `--interpreted` switches compilation off; the command and the nodes ignore signals at their end; and on a busy machine the
    tests after one that has lowered the priority, and what they start, would hardly run.
    """
    niceness = os.getpriority(os.PRIO_PROCESS, 0)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    os.environ.pop("VESSEL_HSMC_INTERPRETED", None)
    for number, handler in handlers.items():
        signal.signal(number, handler)
    assert os.getpriority(os.PRIO_PROCESS, 0) == niceness, "run what lowers the priority in a process of its own"


KINDS = {
    "core": "pure",
    "control": "pure",
    "faults": "pure",
    "guidance": "pure",
    "plant": "pure",
    "studies/rivals": "pure",
    "boats/test_handover.py": "pure",
    "nodes/runs": "files",
    "nodes": "nodes",
    "boats/nodes": "nodes",
    "preflight/nodes": "nodes",
    "processes": "processes",
}
"""The mark of the tests in folders and files, the first that fits; those of all others work on files."""


LONG = (
    *(
        "project/test_install.py",
        "simulation/test_golden_offline.py",
        "processes",
        "studies/paper",
        "control/guided/test_guided.py",
    ),
    *("nodes", "boats/nodes", "preflight/nodes", "control", "simulation", "studies", "report", "plant", "bags"),
)
"""Folders and files with the longest tests: they come first, so that all processes end at about the same time."""


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Collect without looking for garbage: there is none among the tests, and looking takes a third of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@functools.cache
def place(file: Path) -> tuple[int, str]:
    """The place of a test's file or folder in LONG, and its kind."""
    path = file.relative_to(ROOT / "test").as_posix()
    urgency = next((place for place, prefix in enumerate(LONG) if path.startswith(prefix)), len(LONG))
    return urgency, next((kind for prefix, kind in KINDS.items() if path.startswith(prefix)), "files")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark each test with its kind, and let the longest come first."""
    items.sort(key=lambda item: place(item.path)[0])
    for item in items:
        item.add_marker(place(item.path)[1])
