from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.schema import entries
from vessel_hsmc_ros.guided.parameters import GuidedParameters


def gains(*changes: str) -> Result:
    arguments = ["gains", "case2_tracking", *(part for change in changes for part in ("--set", change))]
    return CliRunner(env={"COLUMNS": "200"}).invoke(cli, arguments, catch_exceptions=False, standalone_mode=False)


def line_of(text: str, name: str) -> str:
    (line,) = (line for line in text.splitlines() if line.split()[:1] == [name])
    return line


def test_every_gain_is_listed_with_its_unit_meaning_and_value() -> None:
    result = gains("controller.law=guided", "controller.guided.position_gain=0.25")
    assert result.exit_code == 0
    for name, entry in entries(GuidedParameters).items():
        if entry.type is float:
            assert entry.unit in line_of(result.output, name)
            assert entry.description[:20] in line_of(result.output, name)
    assert line_of(result.output, "position_gain").split()[-1] == "0.25"
    assert line_of(result.output, "cross_track").split()[-1] == "0.04"


def test_margins_of_three_loops_are_printed_and_small_ones_warned_of() -> None:
    calm = gains("controller.law=guided")
    for name in ("surge force", "yaw moment", "position across"):
        assert any(line.strip().startswith(name) and "°" in line for line in calm.output.splitlines())
    hasty = gains("controller.law=guided", "controller.guided.surge_gain=40")
    assert "warning: the loop of the" in hasty.output


def test_the_numbers_and_margins_of_another_law_are_printed() -> None:
    shown = gains("controller.law=los_pid", "controller.los_pid.yaw_bandwidth=0.3").output
    assert line_of(shown, "yaw_bandwidth").split()[-1] == "0.3"
    assert "position across" in shown


def test_the_units_are_those_of_the_ship_and_actuators_that_are_not_declared_are_named() -> None:
    declared = {f"controller.vessel.{axis}_{what}": 0.0 for axis in ("surge", "yaw") for what in ("lag", "dead_time")}
    rates = {"controller.vessel.surge_force_rate": ".inf", "controller.vessel.yaw_moment_rate": ".inf"}
    known = gains("controller.law=guided", *(f"{name}={value}" for name, value in {**declared, **rates}.items())).output
    # sqrt(636e5/3e6) s is 4.6 s.
    assert "L = 32 m, T = 4.6 s\n" in known
    assert "T = 4.6 s; not all of lag, rate and dead time is declared" in gains("controller.law=guided").output
