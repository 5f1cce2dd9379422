import re

import pytest
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
    for name in ("surge force", "yaw moment", "position across"):
        assert any(line.strip().startswith(name) and "°" in line for line in calm.output.splitlines())
    hasty = gains("controller.law=guided", "controller.guided.position_gain=3.0")
    assert "warning: the loop of the" in hasty.output


def test_the_numbers_and_margins_of_another_law_are_printed() -> None:
    shown = gains("controller.law=lqg", "controller.lqg.cross_track=0.2").output
    assert line_of(shown, "cross_track").split()[-1] == "0.2"
    assert "position across" in shown


POWERS = {"": 1, "²": 2, "⁻¹": -1, "⁻²": -2}


@pytest.mark.parametrize("lag", [0.0, 12.0])
def test_each_value_is_its_number_in_the_units_that_are_named(lag: float) -> None:
    declared = [f"controller.vessel.{axis}_{what}" for axis in ("surge", "yaw") for what in ("lag", "dead_time")]
    result = gains("controller.law=guided", *(f"{name}={lag if name.endswith('lag') else 0.1}" for name in declared)).output
    (units,) = (line for line in result.splitlines() if line.startswith("L = "))
    length, time = (float(re.findall(rf"{name} = ([\d.]+) ", units)[0]) for name in "LT")
    (stretch,) = re.findall(r"times ([\d.]+) for rates", units) or ["1"]
    assert (stretch == "1") is (lag == 0.0)
    for name, rule in RULES.items():
        cells = line_of(result, name).split()
        at = next(i for i in range(len(cells) - 1, 0, -1) if cells[i][0].isdigit() or cells[i][0] == "-")
        value, number, shown = float(cells[at - 1]), float(cells[at]), "".join(cells[at + 1 :])
        for unit, power in re.findall(r"([LT])(²|⁻¹|⁻²)?", shown):
            number *= (length if unit == "L" else time * (float(stretch) if rule.stretches else 1.0)) ** POWERS[power]
        assert number == pytest.approx(value, rel=2e-2), name
