"""Each pytest process has a ROS domain of its own, nodes find each other fast, and each test bears the mark of its kind."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]

os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(ROOT / "config" / "fastdds.xml"))

settings.register_profile("steady", deadline=None)  # how long an example takes is the machine's affair
settings.load_profile("steady")


@pytest.fixture(scope="session", autouse=True)
def ros_domain():
    """A domain that no other pytest process on this machine uses, set before any ROS context is made."""
    from domain_coordinator import domain_id

    with domain_id() as domain:
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        yield domain


KINDS = {
    "core": "pure",
    "laws": "pure",
    "control": "pure",
    "plant": "pure",
    "reference": "pure",
    "nodes": "nodes",
    "processes": "processes",
}
"""The mark of the tests in each folder; what is not named here works on files."""


def pytest_collection_modifyitems(items):
    for item in items:
        folder = item.path.relative_to(ROOT / "test").parts[0]
        item.add_marker(KINDS.get(folder, "files"))
