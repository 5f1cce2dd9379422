"""The demonstration: its conclusions and its page."""

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import bag_making
import numpy as np
import pytest
from records import make_run
from unrendered import leave_unrendered

from vessel_hsmc_ros.cli.comparing import compare_runs
from vessel_hsmc_ros.report import Record
from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario
from vessel_hsmc_ros.studies import scenario_run
from vessel_hsmc_ros.studies.scenario_run import conclusions, run_laws


def approaching(name: str, final_distance: float, force: float = 1.0) -> Record:
    """A run that starts 20 m beside its reference and ends at another distance, with a constant force."""
    time = np.linspace(0.0, 100.0, 1001)
    state = np.zeros((1001, 6))
    state[:, 0] = final_distance + (20.0 - final_distance) * (time < 50.0)
    run = make_run(time, state, reference=np.zeros((1001, 6)), wrench=np.full((1001, 2), force))
    return Record(name, run, measured(run))


def test_a_law_with_a_vanishing_position_error_converges() -> None:
    (sentence,) = conclusions([approaching("guided", 0.004)])
    assert sentence == (
        "The guided law converges to the reference: "
        "the position error falls from 20 m to 0.004 m rms over the last quarter of 100 s."
    )


def test_a_law_with_a_lasting_position_error_does_not_converge() -> None:
    (sentence,) = conclusions([approaching("hierarchical_printed", 4.0)])
    assert sentence.startswith(
        "The paper's law as printed (hierarchical_printed) does not converge: the position error is 4 m rms over the last"
        " quarter of 100 s,"
        " while the heading error is 0° at the end: the sway and heading terms of its surface S1 cancel"
    )


def test_approaches_with_unequal_forces_are_not_to_be_compared() -> None:
    *_, sentence = conclusions([approaching("hierarchical_printed", 4.0, 31e6), approaching("guided", 0.004, 2e5)])
    assert sentence == (
        "Compare the last quarter only: on the way the paper's law as printed (hierarchical_printed) used up to 31 MN of surge"
        " force, and the guided law up to 200 kN."
    )
    assert len(conclusions([approaching("hierarchical_printed", 4.0, 2e5), approaching("guided", 0.004, 2e5)])) == 2


def test_runs_without_metrics_allow_no_conclusion() -> None:
    run = approaching("guided", 0.0).run
    assert conclusions([Record("guided", run)]) == ()


@pytest.mark.long
def test_both_runs_are_in_one_page_under_the_names_of_their_laws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    leave_unrendered(monkeypatch)
    for law in ("hierarchical_printed", "guided"):
        bag_making.write_run(tmp_path / law / "bag", 100)
        scenario = load_scenario("case2_tracking", {"controller.law": law})
        (tmp_path / law / "params.yaml").write_text(dump_scenario(scenario))
    compare_runs(
        [tmp_path / law / "bag" for law in ("hierarchical_printed", "guided")], tmp_path / "report.html", "", conclusions
    )
    printed = capsys.readouterr().out
    assert "page: " in printed
    assert "figures: " in printed
    assert (tmp_path / "figures").is_dir()
    page = (tmp_path / "report.html").read_text()
    assert "The guided law" in page
    assert page.index("paper&#39;s law as printed (hierarchical_printed)") < page.index("The guided law")


@pytest.mark.parametrize(("domains", "workers"), [("345", None), ("34", 1), ("3", 1)])
def test_runs_at_the_same_time_have_domains_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, domains: str, workers: int | None
) -> None:
    given: list[Any] = []
    monkeypatch.setattr(scenario_run, "free_domains", lambda _: nullcontext(list(domains)))
    monkeypatch.setattr(scenario_run, "run_all", lambda _, tasks, **options: given.extend((tasks, options["workers"])))
    run_laws(tmp_path, lambda _: None, lambda _: None)
    tasks, number = given
    assert number == workers
    assert [task.law for task in tasks] == list(scenario_run.LAWS)
    assert {task.domain for task in tasks} == set(domains)
