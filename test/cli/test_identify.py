import math
from pathlib import Path

import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.identification.page import CITATION


def call(*arguments: object) -> str:
    return CliRunner().invoke(cli, ["identify", *map(str, arguments)], standalone_mode=False, catch_exceptions=False).output


def test_wrong_use_is_one_line_that_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = tmp_path / "run.csv"
    data.write_text("time,x,y\n0,0,0\n")
    with pytest.raises(ParameterError, match=r"run\.csv"):
        call(data)
    with pytest.raises(ParameterError, match="--column Fx is not allowed: it takes NAME=COLUMN"):
        call(data, "--column", "Fx")
    with pytest.raises(ParameterError, match=r"--held-out .*run\.csv is not allowed: it is a run of the estimation"):
        call(data, "--held-out", tmp_path / "." / "run.csv")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ParameterError, match=r"--held-out .*run\.csv is not allowed: it is a run of the estimation"):
        call("run.csv", "--held-out", data)
    with pytest.raises(ParameterError, match="cubical is not a model"):
        call(data, "--model", "cubical")
    with pytest.raises(ParameterError, match="nowhere"):
        call(tmp_path / "nowhere")


def test_what_it_would_write_is_checked_before_it_computes_and_replaces_no_file_but_an_identified_vessel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def computed(*_: object) -> None:
        raise AssertionError("computed")

    monkeypatch.setattr("vessel_hsmc_ros.identification.estimate.identify", computed)
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
