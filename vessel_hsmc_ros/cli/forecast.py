"""`vessel-hsmc forecast`: whether a vessel can do a mission in the wind and current of today, and what it takes."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from vessel_hsmc_ros.cli.console import print_error, print_files, print_line, print_table, progress_bar
from vessel_hsmc_ros.cli.options import law_file_option, load_checked, output_option, parse_changes, set_option, workers_option
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.run_folder import check_writable, make_run_folder
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, read_changes

NOT_TODAY = 1  # exit code of a mission that is infeasible, or that too many runs fail


@click.command()
@click.argument("mission")
@click.option("--scenario", metavar="SCENARIO", help="The boat, where MISSION is not a scenario.")
@click.option("--wind", type=float, metavar="M/S", help="Mean wind speed [default: that of the scenario].")
@click.option("--wind-from", type=float, metavar="DEG", help="Where the wind comes from, from north.")
@click.option("--current", type=float, metavar="M/S", help="Speed of the current [default: that of the scenario].")
@click.option("--current-to", type=float, metavar="DEG", help="Where the current flows to, from north.")
@click.option("--corridor", type=float, metavar="M", help="Distance from the path beyond which a run fails [default: 2 lengths].")
@click.option("--runs", type=click.IntRange(20, 100_000), default=200, show_default=True, help="Number of runs.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of all that is drawn.")
@workers_option
@set_option
@law_file_option
@output_option
def forecast(mission: str, scenario: str | None, changes: Sequence[str], output: Path, **given: Any) -> None:
    """Tell whether a vessel can do a mission in today's wind and current, and what it takes.

    MISSION is a mission file, or one that `mission --into` wrote, and --scenario is the boat; or MISSION is a scenario with a
    path or a survey. A leg that no law can sail is named without a run. Otherwise --runs runs are simulated, each with its own
    gusts, error of wind and current, hull and noise: time, energy, battery and distance from the path as bands of 5, 50 and
    95 %, and a forecast_page. The exit code is 1 where a leg is infeasible, or more than 5 % of the runs fail.
    """
    _check_directions(given)
    loaded, fences = _loaded(mission, scenario, parse_changes(changes))
    from vessel_hsmc_ros.studies import forecast as studies  # imports the libraries of reports

    plan = studies.plan_of(loaded, _conditions(loaded, given), given["corridor"])
    _check_way(plan.track, fences)
    if reasons := studies.why_infeasible(plan):
        for line in reasons:
            print_error(line)
        sys.exit(NOT_TODAY)
    check_writable(output)
    with progress_bar(f"forecast of {loaded.name}", given["runs"], "runs") as update:
        found = studies.forecast(plan, given["runs"], given["seed"], given["workers"], update)
    from vessel_hsmc_ros.studies import forecast_page

    print_table(*forecast_page.overview(found))
    print_files(forecast_page.write(make_run_folder(output, f"{loaded.name}_forecast").path, found))
    for line in forecast_page.verdict(found):
        (print_line if found.succeeds else print_error)(line)
    sys.exit(0 if found.succeeds else NOT_TODAY)


def _check_directions(given: dict[str, Any]) -> None:
    """Refuse a speed without its direction, and a direction without its speed."""
    for speed, direction in (("wind", "wind-from"), ("current", "current-to")):
        has, towards = given[speed], given[direction.replace("-", "_")]
        if has and towards is None:
            raise click.UsageError(f"--{direction} must be given with --{speed}")
        if has is None and towards is not None:
            raise click.UsageError(f"--{direction} goes with --{speed}")


def _loaded(mission: str, scenario: str | None, changes: dict[str, object]) -> tuple[Scenario, Sequence[Any]]:
    """The boat with its mission, and the fences of the mission."""
    path = Path(mission)
    is_yaml = path.suffix in (".yaml", ".yml")
    if scenario is None:
        loaded = load_scenario(mission, changes) if is_yaml or not path.exists() else None
        if loaded is None or not any(name.startswith("vessel_sim.") for name in loaded.given):
            raise ParameterError(f"--scenario must name the boat that sails {mission} (got none): vessel-hsmc init writes it")
        return load_checked(mission, changes), ()
    if is_yaml:
        return replace(load_checked(scenario, {**read_changes(path), **changes}), name=path.stem), ()
    from vessel_hsmc_ros.cli.mission import sailed_mission  # imports the libraries of missions

    parameters, whole = sailed_mission(path)
    values = {f"reference_ship.{name}": value for name, value in parameters.items()}
    return replace(load_checked(scenario, {**values, **changes}), name=path.stem), whole.fences


def _check_way(track: Any, fences: Sequence[Any]) -> None:
    """Refuse a mission whose planned way leaves its fence."""
    if fences:
        from vessel_hsmc_ros.boats.missions.legs import way_leaving_fence
        from vessel_hsmc_ros.cli.mission import require_within

        require_within(way_leaving_fence(track, fences))


def _conditions(loaded: Scenario, given: dict[str, Any]) -> Any:
    """Wind and current as given, else those of the scenario."""
    from vessel_hsmc_ros.studies.forecast import Conditions, conditions_of

    names = {name: given[name] for name in schema.entries(Conditions) if given[name] is not None}
    try:
        return schema.changed(conditions_of(loaded), names, "forecast")
    except ParameterError as error:
        option, _, rest = str(error).removeprefix("forecast.").partition(" ")
        raise ParameterError(f"--{option.replace('_', '-')} {rest}") from None
