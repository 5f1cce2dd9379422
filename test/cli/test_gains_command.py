from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.cli.gains import REASONS
from vessel_hsmc_ros.guided.rule import RULES


def gains(*changes: str) -> Result:
    arguments = ["gains", "case2_tracking", *(part for change in changes for part in ("--set", change))]
    return CliRunner(env={"COLUMNS": "200"}).invoke(cli, arguments, catch_exceptions=False, standalone_mode=False)


def line_of(text: str, name: str) -> str:
    (line,) = (line for line in text.splitlines() if line.split()[:1] == [name])
    return line


def test_every_gain_is_listed_with_its_origin_reason_and_number() -> None:
    result = gains("controller.law=guided", "controller.guided.position_gain=0.25")
    assert result.exit_code == 0
    assert set(REASONS) == set(RULES)
    for name, reason in REASONS.items():
        assert reason in line_of(result.output, name)
        assert ("by hand" if name == "position_gain" else "derived") in line_of(result.output, name)
    # 0.25 1/s in units of sqrt(636e5/3e6) s is 1.15.
    assert line_of(result.output, "position_gain").split()[-3:] == ["0.25", "1.15", "T⁻¹"]


def test_margins_of_three_loops_are_printed_and_small_ones_warned_of() -> None:
    calm = gains("controller.law=guided")
    for name in ("surge force", "yaw moment", "guidance"):
        assert any(line.strip().startswith(name) and "°" in line for line in calm.output.splitlines())
    hasty = gains("controller.law=guided", "controller.guided.position_gain=3.0")
    assert "warning: the loop of the" in hasty.output


def test_another_law_is_named_with_how_to_use_these_gains() -> None:
    assert "controller.law is hierarchical: --set controller.law=guided" in gains().output
