"""The report of a campaign: its findings in words, its tables, its diagrams and its page."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import NEEDED, Browser, browser
from click.testing import CliRunner
from durations import rest_long
from unrendered import leave_unrendered

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import CampaignError, ReportError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.report.diagrams import Figure
from vessel_hsmc_ros.report.tables import text
from vessel_hsmc_ros.studies.campaign import findings
from vessel_hsmc_ros.studies.campaign.dataset import Dataset, write_file, write_table
from vessel_hsmc_ros.studies.campaign.plan import Campaign, read_source
from vessel_hsmc_ros.studies.campaign.report import diagrams, make_report
from vessel_hsmc_ros.studies.campaign.results import Results, Table, read, share_text

EAST, LAG = "vessel_sim.disturbance.earth_fixed.east_force", "vessel_sim.actuators.yaw_lag"
LIMIT = "position_error_peak_last_quarter"
START = ["vessel_sim.initial_pose[0]", "vessel_sim.initial_pose[1]"]

TWO_LAWS = f"""
scenario: case2_tracking
set: {{vessel_sim.duration: 10.0}}
laws: [guided, los_pid]
runs: 300
draw:
  {EAST}: {{uniform: [0.0, 5000.0]}}
  {LAG}: {{choice: [0.0, 0.5]}}
  controller.hierarchical_printed.switching: {{choice: [sgn, tanh]}}
limits: {{{LIMIT}: 0.1}}
chunk: 600
"""
GRID = f"""
scenario: case2_tracking
set: {{vessel_sim.duration: 10.0}}
draw:
  {START[0]}: {{grid: [-100.0, 100.0, 5]}}
  {START[1]}: {{grid: [0.0, 100.0, 3]}}
"""

Row = dict[str, Any]


def error_by_wind(row: Row) -> Row:
    """The error grows with the wind, tenfold with los_pid; the strongest winds end the runs of los_pid."""
    error = row[EAST] * 2e-6 * (10.0 if row["law"] == "los_pid" else 1.0)
    if row["law"] == "los_pid" and row[EAST] > 4950.0:
        return {"failed": True, "failure": f"the state is no longer finite at {row['run']}.5 s", "ended_early": True}
    failed = error > 0.095
    metrics = dict.fromkeys(Metrics._fields, error) | {LIMIT: error, "surge_force_at_limit": None}
    return {"failed": failed, "failure": f"{LIMIT} = {error:.6g} above 0.1" if failed else "", "ended_early": False, **metrics}


def far_ones_do_not_settle(row: Row) -> Row:
    far = abs(row[START[0]]) > 90.0
    metrics = dict.fromkeys(Metrics._fields, 1.0) | {"settling_time": None if far else 10.0 + row[START[1]]}
    return {"failed": False, "failure": "", "ended_early": False, **metrics}


def make_folder(folder: Path, content: str, result: Callable[[Row], Row], chunks: int = 1) -> Path:
    """Write the folder of a campaign with invented results."""
    (folder / "rows").mkdir(parents=True)
    file = folder / "trial.yaml"
    file.write_text(content)
    campaign = Campaign.parse(read_source(file))
    file.rename(folder / "campaign.yaml")
    (folder / "scenario.yaml").write_text(campaign.source.scenario)
    about = {"name": "trial", "scenario": "case2_tracking", "repetitions": campaign.repetitions}
    (folder / "campaign.json").write_text(json.dumps(about))
    for chunk in range(chunks):
        rows = [_row(campaign, run, result) for run in campaign.runs_of(chunk)]
        write_file(Dataset(folder).chunk_path(chunk), write_table(rows, campaign, chunk))
    return folder


def _row(campaign: Campaign, run: int, result: Callable[[Row], Row]) -> Row:
    planned = campaign.planned(run)
    row = {"run": run, "draw": planned.draw, "law": planned.law, "seed": planned.seed, **planned.values}
    return row | result(row)


@pytest.fixture(scope="module")
def two_laws(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folder(tmp_path_factory.mktemp("two") / "laws", TWO_LAWS, error_by_wind)


@pytest.fixture(scope="module")
def results(two_laws: Path) -> Results:
    return read(two_laws)


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return read(make_folder(tmp_path_factory.mktemp("grid") / "map", GRID, far_ones_do_not_settle))


def words(results: Results) -> dict[str, str]:
    return dict(findings.sentences(results, findings.influences_by_variant(results)))


def drawn(results: Results) -> dict[str, list[Figure]]:
    return diagrams(results, findings.influences_by_variant(results))


@pytest.fixture(scope="module")
def statements(results: Results) -> dict[str, str]:
    return words(results)


@pytest.fixture(scope="module")
def shown(results: Results) -> dict[str, list[Figure]]:
    return drawn(results)


def texts(table: Table) -> list[list[str]]:
    return [[cell.value for cell in line] for line in table.lines]


def test_a_law_without_a_failure_has_a_bound_of_its_probability(results: Results, statements: dict[str, str]) -> None:
    statement = statements["guided"]
    assert statement.startswith("0 of 300 runs failed: a run fails with a probability of at most 0.99 %, at 95 % confidence.")
    median = float(np.sort(results.by_variant["guided"].cost(LIMIT))[149])
    assert f"position error, largest of the last quarter: median {text(LIMIT, median)}, 99 % of the runs below" in statement
    assert f"It depends most on {EAST}" in statement


def test_failures_are_counted_by_reason_without_the_numbers_of_single_runs(results: Results) -> None:
    by_variant = {line[0]: line for line in texts(findings.failures(results))}
    failed, ended = int(results.by_variant["los_pid"].failed.sum()), int(results.by_variant["los_pid"].ended_early.sum())
    assert by_variant["los_pid"][2] == str(failed)
    assert by_variant["los_pid"][-1] == (f"{failed - ended} × {LIMIT} above 0.1; {ended} × the state is no longer finite at … s")
    assert by_variant["guided"][2] == "0"


def test_laws_are_compared_on_the_same_draws(results: Results, statements: dict[str, str]) -> None:
    statement = statements[""]
    assert "guided has the smaller position error, largest of the last quarter than los_pid in 300 of 300 draws" in statement
    assert "the median ratio is 0.1" in statement
    assert all(line[2:5] == ["300", "0", "0"] for line in texts(findings.comparisons(results)))


def test_a_run_that_ended_early_is_above_every_value(results: Results) -> None:
    cost = results.by_variant["los_pid"].cost(LIMIT)
    assert np.isinf(cost).sum() == results.by_variant["los_pid"].ended_early.sum() > 0
    assert texts(findings.quantiles(results))[1][-1] == "–"


def test_a_metric_that_no_run_has_is_left_out(results: Results) -> None:
    assert "surge_force_at_limit" not in results.metrics
    assert results.metrics[0] == results.main == LIMIT


def test_the_worst_runs_have_the_commands_that_repeat_them(results: Results) -> None:
    lines = [line for line in texts(findings.worst(results, Path("my runs/x"))) if line[1] == "guided"]
    wind = results.by_variant["guided"].rows[EAST]
    run = int(results.by_variant["guided"].rows["run"][np.argmax(wind)])
    assert lines[0][0] == f"vessel-hsmc run --campaign 'my runs/x' --run {run}"
    assert float(lines[0][3]) == pytest.approx(wind.max(), rel=1e-3)
    assert texts(findings.worst(results, Path("x")))[findings.WORST][2] == "ended early"


def test_the_parameter_with_influence_has_the_longest_bar(shown: dict[str, list[Figure]]) -> None:
    (bars,) = next(each for each in shown["bars"] if each["title"].startswith("guided: "))["traces"]
    assert bars["customdata"][-1][0] == EAST
    assert bars["x"][-1] > 90.0
    assert all(length <= spread for length, spread in zip(bars["x"][:-1], bars["error_x"]["array"], strict=False))


def test_runs_are_drawn_over_the_strongest_numbers_and_not_over_texts(shown: dict[str, list[Figure]]) -> None:
    scatters = [each for each in shown["scatter"] if each["title"].startswith("guided: ")]
    assert {each["layout"]["xaxis"]["title"]["text"] for each in scatters} == {"earth_fixed.east_force", "actuators.yaw_lag"}
    assert all(sum(len(trace["x"]) for trace in each["traces"]) == 300 for each in scatters)


def test_a_grid_of_starts_is_a_map_of_the_time_to_settle(grid: Results) -> None:
    (shown,) = drawn(grid)["map"]
    assert shown["title"] == "hierarchical_printed: position error, settling time [s]"
    values = [value for line in shown["traces"][0]["z"] for value in line]
    assert (len(values), values.count(None)) == (15, 6)


def test_shares_of_a_grid_are_not_called_probabilities(grid: Results) -> None:
    assert "shares of its points, not probabilities" in words(grid)["hierarchical_printed"]
    assert "Too few runs for sensitivities, which need at least 100." in words(grid)["hierarchical_printed"]
    assert not drawn(grid)["bars"]
    settling = next(line for line in texts(findings.quantiles(grid)) if line[0].endswith("settling time"))
    assert settling[-2] == "none: ended early or not settled"


def test_an_incomplete_campaign_has_a_report_of_its_rows_so_far(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    in_pieces = TWO_LAWS.replace("chunk: 600", "chunk: 20")
    folder = make_folder(tmp_path / "part", in_pieces, error_by_wind, chunks=3)
    _, files = make_report(folder, tmp_path / "page.html")
    assert files["page"] == tmp_path / "page.html"
    assert "60 of 600 runs so far" in files["page"].read_text()
    assert all(path.parent == tmp_path / "figures" for kind, path in files.items() if kind != "page")


def test_a_folder_without_results_or_without_a_campaign_is_named(tmp_path: Path) -> None:
    with pytest.raises(ReportError, match="has no results yet"):
        make_report(make_folder(tmp_path / "new", TWO_LAWS, error_by_wind, chunks=0))
    with pytest.raises(CampaignError, match="is not the folder of a campaign"):
        make_report(tmp_path)


@pytest.fixture(scope="module")
def printed(two_laws: Path) -> str:
    """What the command prints when it makes the report of two laws."""
    done = CliRunner().invoke(cli, ["campaign", "report", str(two_laws)], catch_exceptions=False, standalone_mode=False)
    return done.output


def test_the_command_prints_the_findings_and_writes_page_and_figures(two_laws: Path, printed: str) -> None:
    assert "guided: 0 of 300 runs failed" in printed
    pictures = {path.name for path in (two_laws / "figures").iterdir()}
    assert pictures == {"distributions.png", "parameters.png", "scatter.png"}
    page = (two_laws / "report.html").read_text()
    assert "600 runs (300 draws × 2 laws)" in page
    assert "NaN" not in page[page.index('id="content"') : page.index('id="library"')]
    assert "Infinity" not in page[page.index('id="content"') : page.index('id="library"')]


@pytest.fixture(scope="module")
def tab() -> Iterator[Browser]:
    with browser() as found:
        yield found


@NEEDED
@pytest.mark.parametrize("width", rest_long([400, 1280]))
@pytest.mark.usefixtures("printed")
def test_the_page_draws_all_diagrams_without_the_network(two_laws: Path, tab: Browser, width: int) -> None:
    tab.open(two_laws / "report.html", width)
    assert tab.run("return [...document.querySelectorAll('[data-figure]')].every((each) => each.querySelector('.main-svg'))")
    assert tab.run("return document.documentElement.scrollWidth") <= width
    quantiles = "const table = document.querySelector('#metrics .table'); return table.scrollWidth - table.clientWidth"
    assert width < 1280 or tab.run(quantiles) <= 0
    assert [address for address in tab.requests() if not address.startswith(("file:", "data:", "blob:"))] == []
    assert tab.console() == []


@pytest.mark.long
@NEEDED
@pytest.mark.usefixtures("printed")
def test_a_click_on_a_run_shows_the_command_that_repeats_it(two_laws: Path, tab: Browser) -> None:
    tab.open(two_laws / "report.html")
    tab.run(
        "const plot = document.querySelector('[data-figure=\"scatter 0\"]');"
        "plot.emit('plotly_click', { points: [{ customdata: [17, 'x'] }] });"
    )
    assert tab.run("return document.getElementById('chosen').textContent").endswith("--run 17")
    assert tab.run("return !document.getElementById('replay').hidden")


def test_a_share_is_shown_with_the_digits_that_matter() -> None:
    assert [share_text(share) for share in (0.0, 0.00031234, 0.127, 0.994, 0.995, 0.996, 0.997, 0.9996, 1.0)] == [
        "0 %", "0.031 %", "13 %", "99 %", "99.5 %", "99.6 %", "99.7 %", "99.96 %", "100 %",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("times", "drawn"), [([9.95, 10.0], False), ([9.95, 3.0], True), ([None, 9.99], False), ([None, 3.0], True)]
)
def test_settling_times_are_drawn_unless_every_error_settles_at_the_end_of_its_run(
    tmp_path: Path, times: list[float | None], drawn: bool
) -> None:
    def settling(row: Row) -> Row:
        metrics = dict.fromkeys(Metrics._fields, 1.0) | {"leg_cross_track_rms": None, "settling_time": times[row["run"] % 2]}
        return {"failed": False, "failure": "", "ended_early": False, **metrics}

    made = read(make_folder(tmp_path / "map", GRID, settling))
    names = [each["title"] for each in diagrams(made, {})["exceedance"]]
    assert any("settling time" in name for name in names) == drawn


def test_the_settling_times_of_surveys_are_not_drawn(tmp_path: Path) -> None:
    def surveyed(row: Row) -> Row:
        metrics = dict.fromkeys(Metrics._fields, 1.0) | {"settling_time": 3.0}
        return {"failed": False, "failure": "", "ended_early": False, **metrics}

    made = read(make_folder(tmp_path / "map", GRID, surveyed))
    assert not any("settling time" in each["title"] for each in diagrams(made, {})["exceedance"])
