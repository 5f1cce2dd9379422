from pathlib import Path

import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError


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
