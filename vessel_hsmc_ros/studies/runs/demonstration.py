"""The demonstration: case 2 of the paper under its law, repaired and as printed, and under guided, compared in one page."""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from vessel_hsmc_ros.core.metrics import Metrics, position_error
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.scenario.run_folder import RunFolder, make_run_folder
from vessel_hsmc_ros.scenario.scenario import for_nodes, load_scenario
from vessel_hsmc_ros.studies.runs import scenario_run
from vessel_hsmc_ros.studies.runs.batch import run_all
from vessel_hsmc_ros.studies.runs.scenario_run import DOMAIN, Progress, Result, free_domains

if TYPE_CHECKING:
    from vessel_hsmc_ros.report.record import Record

SCENARIO = "case2_tracking"
LAWS = ("hierarchical", "hierarchical_printed", "guided")
"""In the order of their colours in comparisons (`comparison.COLOURS`), so that a law has one colour in every figure."""

DURATION = 100.0  # simulated time, s: long enough to show which law converges, and short enough to wait for
CONVERGED = 0.5  # a law with a smaller rms position error over the last quarter of the run counts as converged, m
UNEQUAL_FORCES = 10.0  # ratio of the largest surge forces of two runs above which their approaches cannot be compared
TITLES = {
    "hierarchical": "The paper's law, repaired (hierarchical)",
    "hierarchical_printed": "The paper's law as printed (hierarchical_printed)",
    "guided": "The guided law",
}
CAUSES = {
    "hierarchical_printed": "the sway and heading terms of its surface S1 cancel each other without vanishing (equation 46)"
}
"""Why a law fails to converge, where the analysis in docs/paper.md explains it."""


class Task(NamedTuple):
    """A run of the demonstration: its law, its folder, its ROS domain and its simulated time, s."""

    law: str
    folder: RunFolder
    domain: str
    duration: float


def run_laws(output: Path, progress: Progress, on_result: Callable[[Result], None]) -> RunFolder:
    """Run the scenario under each law by the nodes: at the same time in ROS domains of their own, if there are cores for it."""
    with free_domains(len(LAWS)) as domains:
        parent = make_run_folder(output, "demo")
        folders = [RunFolder(parent.path / law) for law in LAWS]
        tasks = [Task(*each, DURATION) for each in zip(LAWS, folders, cycle(domains), strict=False)]
        # Runs that share a domain take place one after the other; otherwise there is one for each core.
        workers = None if len(domains) == len(LAWS) else 1
        run_all(_run, tasks, workers=workers, on_result=on_result, on_progress=progress)
    return parent


def _run(task: Task, progress: Progress) -> Result:
    """Run the scenario under a law into its folder."""
    requested_at = time.time()
    os.environ[DOMAIN] = task.domain
    settings = {"controller.law": task.law, "vessel_sim.duration": task.duration}
    scenario = load_scenario(SCENARIO, {**for_nodes(recorded=True, real_time=False), **settings})
    task.folder.path.mkdir()
    return scenario_run.run_nodes(scenario, task.folder, "", progress, requested_at=requested_at)


class Comparison(NamedTuple):
    """The runs of the demonstration, a sentence on each, and the written files by kind."""

    records: list["Record"]
    conclusions: tuple[str, ...]
    files: dict[str, Path]


def compare_bags(bags: Sequence[Path], page: Path) -> Comparison:
    """Write a page that overlays the runs of the demonstration."""
    from vessel_hsmc_ros.report.making import Options, read, write  # imports the libraries of reports

    records = read(bags)
    notes = conclusions(records)
    made = write(records, Options(page=page, title=f"{SCENARIO}: {', '.join(LAWS)}", figures="png", notes=notes))
    return Comparison(records, notes, made.files)


def conclusions(records: Sequence["Record"]) -> tuple[str, ...]:
    """One sentence on each run, whether its law converges, and one on the forces by which their approaches differ."""
    judged = [(record, record.metrics) for record in records if record.metrics]
    return (*(_conclusion(record, metrics) for record, metrics in judged), *_forces(judged))


def _forces(judged: Sequence[tuple["Record", Metrics]]) -> Iterator[str]:
    """A sentence where the surge forces differ so much that the errors of the approaches cannot be compared."""
    if len(judged) < 2:
        return
    ordered = sorted(judged, key=lambda pair: pair[1].surge_force_peak)
    (weak, least), (strong, most) = ordered[0], ordered[-1]
    if most.surge_force_peak > UNEQUAL_FORCES * least.surge_force_peak:
        yield (
            f"Compare the last quarter only: on the way {_title(strong, first=False)} used"
            f" up to {quantity(most.surge_force_peak, 'N')} of surge force, and {_title(weak, first=False)} up to"
            f" {quantity(least.surge_force_peak, 'N')}."
        )


def _title(record: "Record", first: bool = True) -> str:
    """The name of a run's law in a sentence, at its beginning or within it."""
    title = TITLES.get(record.name, record.name)
    return title if first else title[0].lower() + title[1:]


def _conclusion(record: "Record", metrics: Metrics) -> str:
    run = record.run
    law = _title(record)
    late = f"{metrics.position_error_rms_last_quarter:.2g} m rms over the last quarter of {record.duration:g} s"
    initial = float(position_error(run.state[:1], run.reference[:1])[0])
    if metrics.position_error_rms_last_quarter < CONVERGED:
        return f"{law} converges to the reference: the position error falls from {initial:.3g} m to {late}."
    heading = f"while the heading error is {abs(metrics.heading_error_final_deg):.1g}° at the end"
    cause = f": {CAUSES[record.name]}" if record.name in CAUSES else ""
    return f"{law} does not converge: the position error is {late}, {heading}{cause}."
