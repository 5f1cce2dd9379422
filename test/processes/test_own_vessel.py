"""The page from the data of a boat to the law that steers it: each of its commands works, one after the other."""

import json
import re
from pathlib import Path

import pytest
import yaml
from harness import exit_code, run_folder

PAGE = (Path(__file__).parents[2] / "docs" / "own_vessel.md").read_text(encoding="utf-8")


@pytest.mark.long
def test_the_commands_of_the_tutorial_lead_from_data_to_an_identified_boat_under_control(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = re.findall(r"^vessel-hsmc .*$", PAGE, re.MULTILINE)
    assert len(lines) == 10
    init = next(line for line in lines if line.startswith("vessel-hsmc init my_boat"))
    monkeypatch.chdir(tmp_path)
    shown = {}
    for line in lines:
        name, *arguments = line.split()
        assert name == "vessel-hsmc"
        found = [str(path) for text in arguments for path in (sorted(tmp_path.glob(text)) if "*" in text else [text])]
        page = ["--no-page"] if "trial" in arguments or "otter_runs" in arguments else []  # the last two commands draw theirs
        monkeypatch.setattr("sys.argv", ["vessel-hsmc", *found, *page])
        assert exit_code() == 0, (line, capsys.readouterr())
        shown[line] = capsys.readouterr().out
    assert "follows its circle" in shown[init]
    for output in re.findall(r"^```text\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL):
        for line in output.splitlines():
            assert line.removesuffix("...") in shown[init]
    hull = yaml.safe_load((tmp_path / "my_boat_identified.yaml").read_text(encoding="utf-8"))["vessel"]
    assert abs(hull["surge_inertia"] / 525.0 - 1.0) < 0.02
    assert abs(hull["yaw_inertia"] / 750.0 - 1.0) < 0.02
    document = yaml.safe_load((tmp_path / "my_boat_identified.yaml").read_text(encoding="utf-8"))
    assert any("my_boat_offline, position on held-out data" in line for line in document["checks"]["verified"])
    folder = run_folder(tmp_path / "second_runs")
    assert folder is not None
    metrics = json.loads((folder / "run.json").read_text(encoding="utf-8"))["metrics"]
    assert metrics["position_error_peak_last_quarter"] < 0.08
