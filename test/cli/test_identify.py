import math
import re
from pathlib import Path

import pytest
from boat_bags import sailed, write_boat
from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.studies.identification.page import CITATION


def call(*arguments: object) -> str:
    return CliRunner().invoke(cli, ["identify", *map(str, arguments)], standalone_mode=False, catch_exceptions=False).output


def test_wrong_use_is_one_line_that_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = tmp_path / "run.csv"
    data.write_text("time,x,y\n0,0,0\n")
    with pytest.raises(ParameterError, match=r"run\.csv"):
        call(data)
    with pytest.raises(ParameterError, match=r"--column must be NAME=COLUMN.*got Fx"):
        call(data, "--column", "Fx")
    with pytest.raises(ParameterError, match=r"--held-out must be a run that the estimation does not use \(got .*run\.csv\)"):
        call(data, "--held-out", tmp_path / "." / "run.csv")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ParameterError, match=r"--held-out must be a run that the estimation does not use \(got .*run\.csv\)"):
        call("run.csv", "--held-out", data)
    with pytest.raises(ParameterError, match="cubical is not a model"):
        call(data, "--model", "cubical")
    with pytest.raises(ParameterError, match="nowhere"):
        call(tmp_path / "nowhere")


@pytest.mark.parametrize("name", ["run.csv", "LOG.CSV", "Log.Csv"])
def test_a_table_is_one_whatever_the_letters_of_its_suffix(tmp_path: Path, name: str) -> None:
    data = tmp_path / name
    data.write_text("time,x,y\n0,0,0\n")
    with pytest.raises(ParameterError, match=f"{name} has no column heading"):
        call(data)


@pytest.mark.long
def test_it_ends_with_the_next_command_and_its_progress_begins_at_the_beginning(tmp_path: Path) -> None:
    data, folder = write_boat(tmp_path / "bag_0.mcap", sailed()), tmp_path / "a folder"
    options = ("--length", 4, "--beam", 2, "--model", "paper", "--output", folder, "--name", "cat")
    lines = call(data, *options).splitlines()
    assert lines[0] == "identifying cat"
    assert f"next: vessel-hsmc init NAME --vessel '{folder / 'cat.yaml'}'" in lines
    shares = [int(found[1]) for line in lines if (found := re.match(r"identifying cat: (\d+) %", line))]
    assert shares == sorted(shares)


def test_what_it_would_write_is_checked_before_it_computes_and_replaces_no_file_but_an_identified_vessel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def computed(*_: object) -> None:
        raise AssertionError("computed")

    monkeypatch.setattr("vessel_hsmc_ros.studies.identification.estimate.identify", computed)
    data = tmp_path / "run.csv"
    rows = [f"{0.1 * k},{0.05 * k},0,0,{100.0 * math.sin(0.1 * k)},{50.0 * math.cos(0.1 * k)}\n" for k in range(600)]
    data.write_text("time,x,y,heading,surge_force,yaw_moment\n" + "".join(rows), encoding="utf-8")
    command = (data, "--output", tmp_path, "--name", "my_boat")
    with pytest.raises(ParameterError, match="the beam of the ship is not known"):
        call(*command, "--length", 4)
    own = tmp_path / "my_boat.yaml"
    own.write_text("# a scenario of one's own\n", encoding="utf-8")
    with pytest.raises(ParameterError, match=r"my_boat\.yaml exists and is not an identified vessel: choose another --name"):
        call(*command, "--length", 4, "--beam", 2)
    assert own.read_text(encoding="utf-8") == "# a scenario of one's own\n"
    own.write_text(f"source: {{citation: {CITATION} 0.1}}\n", encoding="utf-8")
    with pytest.raises(AssertionError, match="computed"):
        call(*command, "--length", 4, "--beam", 2)
