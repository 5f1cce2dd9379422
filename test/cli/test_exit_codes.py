"""Exit codes of `vessel-hsmc`: 0 success, 1 failure, 2 wrong use, 130 Ctrl-C; errors are one line without a traceback."""

import signal
from pathlib import Path

import pytest
from reaching import exit_code_of

NO_BAG = (["report", "nothere"], ["recover", "nothere"], ["replay", "nothere"], ["identify", "nothere"])


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["simulate", "nothing_like_it"], 2, "error: scenario nothing_like_it is unknown: it must be one of"),
        (["simulate", "case2_tracking", "--set", "controller.speed=3"], 2, "error: controller.speed is not a parameter"),
        (["simulate", "case2_tracking", "--set", "controller.rate_hz=-5"], 2, "error: controller.rate_hz must be"),
        (["simulate", "case2_tracking", "--set", "controller.rate_hz=50"], 2, "is unstable at controller.rate_hz = 50 Hz"),
        (["simulate", "case2_tracking", "--set", "vessel_sim.duration"], 2, "must be node.param=value"),
        (["simulate", "case2_tracking", "--set", "vessel_sim.duration=0"], 2, "vessel_sim.duration must be above 0 s"),
        (["run", "case2_tracking", "--namespace", "no good"], 2, "error: namespace must be"),
        (["compare"], 2, "give a SCENARIO or --suite"),
        (["simulate"], 2, "Missing argument 'SCENARIO'"),
        (["dance"], 2, "No such command 'dance'"),
        (["recover", "/dev/null"], 1, "error: /dev/null is not a bag folder"),
        *((verb, 2, "error: bag nothere does not exist") for verb in NO_BAG),
        (["simulate", "case2_tracking", "--set", "controller.law=guidd"], 2, "did you mean guided?"),
        (["simulate", "case2_tracking", "--set", "vessel=ottr"], 2, "did you mean otter?"),
        (
            ["compare", "case2_tracking", "--laws", "guided,los_pid,guided"],
            2,
            "error: --laws must name each law once (got guided,",
        ),
        (["compare", "case2_tracking", "--laws", "guidd"], 2, "did you mean guided?"),
    ],
)
def test_wrong_use_exits_with_2_and_a_failed_command_with_1(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    arguments: list[str],
    code: int,
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert exit_code_of(monkeypatch, *arguments) == code
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.out == ""
    assert not any(tmp_path.iterdir())


def test_an_output_folder_that_cannot_be_created_exits_with_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    short = ["--set", "vessel_sim.duration=0.1"]
    assert exit_code_of(monkeypatch, "simulate", "case2_tracking", *short, "--output", "/dev/null") == 1
    assert "cannot be made" in capsys.readouterr().err


def test_help_exits_with_0(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code_of(monkeypatch, "--help") == 0
    assert "simulate" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "work"),
    [
        (["simulate", "case2_tracking"], "vessel_hsmc_ros.simulation.offline.ClosedLoop.run"),
        (
            ["compare", "case2_tracking", "--laws", "los_pid", "--workers", "1"],
            "vessel_hsmc_ros.studies.comparison.simulate",
        ),
        (["report", "bag"], "vessel_hsmc_ros.report.page.make"),
    ],
)
def test_ctrl_c_exits_with_130_and_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: list[str], work: str
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(work, interrupted)
    assert exit_code_of(monkeypatch, *arguments) == 130
    assert "Traceback" not in capsys.readouterr().err
