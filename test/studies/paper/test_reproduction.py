"""`reproduce` from its cases to its files, with runs of two seconds."""

import dataclasses
import json
import math
from functools import partial
from pathlib import Path

import pytest

from vessel_hsmc_ros.core.exceptions import RunError, SimulationError
from vessel_hsmc_ros.simulation.compilation import DISABLED
from vessel_hsmc_ros.studies import batch
from vessel_hsmc_ros.studies.paper import reproduction
from vessel_hsmc_ros.studies.paper.cases import CASES, CLAIMS
from vessel_hsmc_ros.studies.paper.measure import CaseResult

DURATION = 2.0
SHORT = [dataclasses.replace(case, changes={**case.changes, "vessel_sim.duration": DURATION}) for case in CASES]
FIGURES = [
    *("figure_01_course", "figure_02_course_disturbed", "figure_03_track", "figure_04_velocities", "figure_05_yaw"),
    *("figure_06_wrench", "figure_07_stabilisation", "figure_08_stabilisation_velocities", "figure_09_stabilisation_yaw"),
    *("figure_10_stabilisation_wrench", "why_1_errors", "why_2_reduced_dynamics", "why_3_surfaces", "why_4_networks"),
]


@pytest.fixture(scope="module")
def progress() -> list[float]:
    return []


@pytest.fixture(scope="module")
def results(progress: list[float]) -> dict[str, CaseResult]:
    with pytest.MonkeyPatch.context() as patch:  # in this process: some of the cases are run again in others
        patch.setattr(batch, "run_all", partial(batch.run_all, workers=1))
        patch.setenv(DISABLED, "1")  # runs this short take less time than the compilation of their laws
        return reproduction.run_cases(SHORT, None, progress.append)


@pytest.fixture(scope="module")
def folder(results: dict[str, CaseResult], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reproduction")
    reproduction.write(results, folder, SHORT)
    return folder


@pytest.mark.long
def test_every_case_is_run_and_its_progress_reported(results: dict[str, CaseResult], progress: list[float]) -> None:
    assert list(results) == [case.name for case in CASES]
    assert progress[-1] == pytest.approx(DURATION * len(CASES))
    assert progress == sorted(progress)


@pytest.mark.long
def test_figures_1_to_10_and_the_explanations_are_drawn(folder: Path) -> None:
    assert sorted(path.stem for path in (folder / "figures").iterdir()) == FIGURES
    for path in (folder / "figures").iterdir():
        data = path.read_bytes()
        assert data.startswith(b"\x89PNG")
        assert int.from_bytes(data[16:20], "big") > 800, "as wide as a column at 200 dpi"


def test_results_are_read_back_as_written(folder: Path, results: dict[str, CaseResult]) -> None:
    document = json.loads((folder / "results.json").read_text())
    assert len(document["claims"]) == len(CLAIMS)
    assert "NaN" not in (folder / "results.json").read_text()
    numbers = reproduction.load(folder / "results.json")
    for name, result in results.items():
        assert dataclasses.asdict(numbers[name]) == pytest.approx(dataclasses.asdict(result.numbers), rel=0.0, nan_ok=True)


def test_a_second_run_gives_identical_bytes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DISABLED, "1")  # compiled runs are bit-identical: test/simulation
    some = [case for case in SHORT if case.name in ("course", "circle", "circle_exact", "circle_50_hz")]
    again = reproduction.run_cases(some, None, lambda _: None)
    cases = json.loads((folder / "results.json").read_text())["cases"]
    for name, result in again.items():
        measured = {key: value for key, value in dataclasses.asdict(result.numbers).items() if not math.isnan(value)}
        assert json.dumps(measured) == json.dumps(cases[name]["numbers"])


def test_an_expected_divergence_is_timed_and_an_unexpected_one_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DISABLED, "1")
    (case,) = [case for case in CASES if case.name == "circle_50_hz"]
    shorter = dataclasses.replace(case, rate_hz=45.0, changes={"vessel_sim.duration": 8.0})
    numbers = reproduction.run_cases([shorter], None, lambda _: None)["circle_50_hz"].numbers
    assert 0.0 < numbers.ended_at < 8.0
    assert numbers.duration == pytest.approx(numbers.ended_at - min(1.0, 0.1 * numbers.ended_at), abs=0.03)
    with pytest.raises(SimulationError, match="no longer finite"):
        reproduction.run_cases([dataclasses.replace(shorter, ends=False)], None, lambda _: None)


def test_an_error_of_one_case_cancels_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DISABLED, "1")
    broken = dataclasses.replace(CASES[0], scenario="case2_tracking", rate_hz=45.0, changes={"vessel_sim.duration": 20.0})
    long = dataclasses.replace(CASES[4], changes={"vessel_sim.duration": 20_000.0})
    with pytest.raises(SimulationError):
        reproduction.run_cases([broken, long], None, lambda _: None)


def test_unreadable_results_are_rejected_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "results.json").write_text('{"cases": {"circle": {"numbers": {"nonsense": 1.0}}}}')
    with pytest.raises(RunError, match=r"results .*results.json cannot be read: .*nonsense"):
        reproduction.load(tmp_path / "results.json")
