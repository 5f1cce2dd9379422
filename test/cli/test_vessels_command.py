from pathlib import Path

from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.scenario.vessels import vessel_names


def output(*arguments: str) -> str:
    result = CliRunner(env={"COLUMNS": "200"}).invoke(cli, ["vessels", *arguments], catch_exceptions=False, standalone_mode=False)
    return result.output


def test_the_list_has_a_line_for_each_vessel_and_its_open_points() -> None:
    lines = output().splitlines()
    for name in vessel_names():
        assert sum(line.split()[:1] == [name] for line in lines) == 1
    (otter,) = (line for line in lines if line.split()[:1] == ["otter"])
    assert otter.split()[-4:] == ["4", "of", "4", "2"]


def test_one_vessel_is_shown_with_source_figures_hull_data_and_what_is_not_verified() -> None:
    text = output("heron")
    for part in (
        "Clearpath",
        "licence: BSD",
        "top_speed m/s",
        "16.44998712",
        "+66.3 %, not verified",
        "not verified: the top speed",
    ):
        assert part in text


def test_a_vessel_file_of_ones_own_is_shown_in_the_same_way(tmp_path: Path) -> None:
    path = tmp_path / "boat.yaml"
    path.write_text(
        "vessel: {length: 3.0, beam: 1.2, surge_inertia: 300.0, sway_inertia: 400.0, yaw_inertia: 200.0,"
        " surge_damping: 60.0, sway_damping: 200.0, yaw_damping: 0.0, surge_force_limit: 120.0}",
        encoding="utf-8",
    )
    text = output(str(path))
    assert text.startswith("boat\n")
    assert [line.split()[2] for line in text.splitlines() if "top_speed" in line] == ["2"]
