"""`vessel-hsmc recover`: which repairs it reports."""

from contextlib import closing
from pathlib import Path

import pytest
from bag_making import write_run
from click.testing import CliRunner

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import BagError


def recover(path: Path) -> str:
    """The output of the command; its errors are raised."""
    return CliRunner().invoke(cli, ["recover", str(path)], catch_exceptions=False, standalone_mode=False).output


def test_recover_reports_its_repairs_and_leaves_a_complete_bag_unchanged(tmp_path: Path) -> None:
    write_run(tmp_path / "bag", 100)
    path = tmp_path / "bag" / "bag_0.mcap"
    path.write_bytes(path.read_bytes()[:-1000])
    (tmp_path / "bag" / "metadata.yaml").unlink()
    assert "messages can be read; 1 of its files completed" in recover(tmp_path / "bag")
    assert open_bag(tmp_path / "bag").complete
    content = path.read_bytes()
    assert " is complete: " in recover(tmp_path / "bag")
    assert path.read_bytes() == content


def test_a_bag_that_is_being_recorded_is_refused_and_left_unchanged(tmp_path: Path) -> None:
    with closing(BagWriter(tmp_path / "bag")) as writer:
        content = (tmp_path / "bag" / "bag_0.mcap").read_bytes()
        with pytest.raises(BagError, match=r"bag_0\.mcap is being recorded: end the recorder before the repair"):
            recover(tmp_path / "bag")
        assert (writer.directory / "bag_0.mcap").read_bytes() == content
    assert " is complete: " in recover(tmp_path / "bag")


def test_a_folder_without_a_bag_and_a_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError):
        recover(tmp_path)
    with pytest.raises(BagError, match="is not a bag folder"):
        recover(Path(__file__))
