"""Bags that cannot be read, and what is asked for and not there: one clear line each."""

import shutil

import pytest
import yaml
from bag_making import TYPES, topic, write_run

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_sim_node.plant import VesselParameters

VESSEL = VesselParameters().coefficients()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    directory = tmp_path_factory.mktemp("recorded") / "bag"
    write_run(directory, 30)
    return directory


def damaged(path):
    content = bytearray(path.read_bytes())
    content[1000] ^= 0xFF
    path.write_bytes(content)


def newer(path):
    told = yaml.safe_load((path.parent / "metadata.yaml").read_text())
    told["rosbag2_bagfile_information"]["version"] = 10
    (path.parent / "metadata.yaml").write_text(yaml.safe_dump(told))


def of_sqlite(path):
    text = (path.parent / "metadata.yaml").read_text()
    (path.parent / "metadata.yaml").write_text(text.replace("storage_identifier: mcap", "storage_identifier: sqlite3"))


WRONG = {
    "empty": (lambda path: path.write_bytes(b""), r"bag_0\.mcap is empty"),
    "truncated": (lambda path: path.write_bytes(path.read_bytes()[:12]), "not even the beginning of an MCAP file"),
    "foreign": (lambda path: path.write_bytes(b"SQLite format 3\0" * 100), "is not an MCAP file"),
    "corrupt": (damaged, r"bag_0\.mcap is damaged at byte \d+: `vessel-hsmc recover` makes the rest of it readable"),
    "missing": (lambda path: path.unlink(), "is not a bag: it holds no MCAP file"),
    "newer": (newer, "has version 10, which is newer than 9, the last that this package reads"),
    "sqlite": (of_sqlite, "is stored as sqlite3: only mcap is read"),
    "metadata": (lambda path: (path.parent / "metadata.yaml").write_text("{"), "cannot be read as a bag's metadata"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_read_is_told_in_one_line(recorded, tmp_path, case):
    shutil.copytree(recorded, tmp_path / "bag")
    spoil, told = WRONG[case]
    spoil(tmp_path / "bag" / "bag_0.mcap")
    with pytest.raises(BagError, match=told) as error:
        open_bag(tmp_path / "bag").run(VESSEL)
    assert "\n" not in str(error.value)


def test_a_bag_without_odometry_says_what_it_has(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/reference", TYPES["reference"]))
    writer.close()
    with pytest.raises(BagError, match="has no odometry: its topics are /reference"):
        open_bag(tmp_path / "bag").run(VESSEL)


def test_a_field_or_topic_that_is_not_there_is_told_with_those_that_are(recorded):
    bag = open_bag(recorded)
    with pytest.raises(BagError, match=r"/odom has no field speed: it takes one of header\.stamp\.sec"):
        bag["odom"]["speed"]
    with pytest.raises(BagError, match="has 0 topics named wind: it has /odom"):
        bag["wind"]
    with pytest.raises(BagError, match="does not exist"):
        open_bag(recorded / "nowhere")
