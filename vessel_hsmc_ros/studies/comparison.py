"""Comparison of control laws: every law on every case, simulated offline on all cores."""

import importlib.util
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, cycle, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core.exceptions import ControlError, InstabilityError, SimulationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Run, heading_error, position_error, reversals_per_second, rms, travel
from vessel_hsmc_ros.core.quantities import quantity, scaled
from vessel_hsmc_ros.report.diagrams import LAW_COLOURS, SERIES, Axis, Figure, draw, layout, level, line, points, run_colour
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.report.record import bounds, planned
from vessel_hsmc_ros.scenario.run_folder import file_name, provenance
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.compile import ensure_compiled
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies import batch
from vessel_hsmc_ros.studies.suite import WINDOWS, Row, Verdict, judge

FALLBACK_RATE_HZ = 100.0  # rate of a law that is unstable at the requested one; the notes of the comparison mention it
POINTS = 3000  # approximate number of points of a line in a figure
SETTLED = 100.0  # reversals of the wrench are counted after this transient, or over the last quarter of a shorter run, s


class LawMetrics(NamedTuple):
    """Tracking errors over the row's window and at the end, and the control effort of the whole run."""

    # position_rms, position_largest: over the row's window, m
    position_rms: float
    position_largest: float
    position_final: float  # m
    heading_rms_deg: float  # over the row's window
    # surge_force_rms, yaw_moment_rms: N, N·m
    surge_force_rms: float
    yaw_moment_rms: float
    reversals: float  # sign changes of the rate of force or moment, whichever has more, 1/s; a measure of chattering
    travel: float = math.nan  # actuator travel, the sum for force and moment, 1/min; NaN without limits
    legs: float | None = None  # cross-track error on the planned legs of the whole run, rms, m; None without legs


@dataclass(frozen=True)
class LawRun:
    """The outcome of one law on one row."""

    # row, law, rate_hz: the case, the law and its rate
    row: Row
    law: str
    rate_hz: float
    fell_back: bool = False  # whether the rate is FALLBACK_RATE_HZ because the law is unstable at the requested one
    failure: str = ""  # why the run ended early, in one line; empty if it did not
    # metrics, verdict: None for a run that ended early
    metrics: LawMetrics | None = None
    verdict: Verdict | None = None
    # decimated time, ship and reference positions and position error, (m, 6), for the figures
    lines: Array = field(default_factory=lambda: np.empty((0, 6)))

    @property
    def hit(self) -> bool:
        """Whether the run meets the row's limits."""
        return self.verdict is not None and self.verdict.hit


class Task(NamedTuple):
    """One run of a comparison: a row, a law, and the law's rate, Hz; None for the rate of the row's scenario."""

    row: Row
    law: str
    rate_hz: float | None


def default_laws() -> list[str]:
    """The laws that track the position of the reference; model predictive control only if CasADi is installed."""
    tracking = [name for name, kind in LAWS.items() if kind.controller.tracks]
    return [name for name in tracking if name != "nmpc" or importlib.util.find_spec("casadi")]


def prepare(task: Task) -> tuple[Scenario, bool]:
    """Load the scenario of a task; a law that is unstable at the requested rate falls back to FALLBACK_RATE_HZ.

    Returns the scenario, and whether the rate fell back.
    """
    changes = {**task.row.changes, "controller.law": task.law}
    if task.rate_hz is not None:
        changes["controller.rate_hz"] = task.rate_hz
    try:
        return load_scenario(task.row.scenario, changes), False
    except InstabilityError:
        return load_scenario(task.row.scenario, changes | {"controller.rate_hz": FALLBACK_RATE_HZ}), True


def run_task(task: Task, progress: Callable[[float], None] | None = None) -> LawRun:
    """Simulate and evaluate one law on one row; a simulation that fails is an outcome, not an error."""
    scenario, fell_back = prepare(task)
    outcome = LawRun(task.row, task.law, scenario.controller.rate_hz, fell_back)
    try:
        run = simulate(scenario, (lambda done, total: progress(done / total)) if progress else None)
    except (ControlError, SimulationError) as error:
        return replace(outcome, failure=str(error))
    verdict = judge(task.row, run, planned(scenario))
    return replace(outcome, metrics=measure(task.row, run, scenario, verdict), verdict=verdict, lines=_lines(run))


def measure(row: Row, run: Run, scenario: Scenario, verdict: Verdict) -> LawMetrics:
    """Evaluate the metrics of a run over the window of its row, for which the verdict has the position errors."""
    span = run.time[-1] - run.time[0]
    window = run.time >= run.time[0] + WINDOWS[row.over] * span
    angle = np.degrees(heading_error(run.state, run.reference))
    # Chattering is a property of the steady state: reversals during the transient would hide it.
    settled = run.time[0] + (SETTLED if span > 2.0 * SETTLED else 0.75 * span)
    travels = [travel(run.time, run.wrench[:, i], bound) for i, bound in enumerate(bounds(scenario))]
    return LawMetrics(
        verdict.rms,
        verdict.largest,
        float(position_error(run.state, run.reference)[-1]),
        rms(angle[window]),
        rms(run.wrench[:, 0]),
        rms(run.wrench[:, 1]),
        max(reversals_per_second(run.time, run.wrench[:, i], settled) for i in (0, 1)),
        sum(math.nan if each is None else each for each in travels),
        verdict.legs if math.isfinite(verdict.legs) else None,
    )


def _lines(run: Run) -> Array:
    thin = slice(None, None, max(1, len(run.time) // POINTS))
    columns = (run.time[:, None], run.state[:, :2], run.reference[:, :2], position_error(run.state, run.reference)[:, None])
    return np.hstack(columns)[thin]


def compare(tasks: Sequence[Task], jobs: int | None = None, progress: Callable[[LawRun], None] | None = None) -> list[LawRun]:
    """Run all tasks in parallel processes. `jobs`: number of processes; None for one per core."""
    # All are prepared before the first one runs: a wrong name is reported at once and not after minutes of simulation.
    ensure_compiled([prepare(task)[0] for task in tasks])
    return batch.run_all(run_task, tasks, workers=jobs, on_result=progress)


NUMBERS = (
    ("rms", "m"),
    ("largest", "m"),
    ("final", "m"),
    ("heading", "°"),
    ("force", "N"),
    ("moment", "N·m"),
    ("rev/s", ""),
    ("travel/min", ""),
    ("legs", "m"),
)
"""Columns of the fields of LawMetrics with their SI units: position errors, rms heading error, rms wrench, reversals, travel,
error on the legs."""

MAX_FINDINGS = 3  # largest number of rows that the title names, and that have a sentence each


def looks(laws: Iterable[str]) -> dict[str, dict[str, str]]:
    """Colour and dashes of the line of each law; where the colours of other laws recur, their lines are dash-dotted or dotted."""
    others = [law for law in dict.fromkeys(laws) if law not in LAW_COLOURS]
    given = cycle(product(("solid", "dashdot", "dot"), range(len(LAW_COLOURS), len(SERIES))))
    numbered = [(law, "solid", i) for i, law in enumerate(LAW_COLOURS)]
    numbered += [(law, dash, i) for law, (dash, i) in zip(others, given, strict=False)]
    return {law: {"colour": run_colour(i), "dash": dash} for law, dash, i in numbered}


def by_row(outcomes: Sequence[LawRun]) -> list[tuple[Row, list[LawRun]]]:
    """Group outcomes by row, rows and laws in the given order."""
    rows: list[tuple[Row, list[LawRun]]] = []
    for outcome in outcomes:
        if not rows or rows[-1][0] != outcome.row:
            rows.append((outcome.row, []))
        rows[-1][1].append(outcome)
    return rows


def limits(row: Row) -> str:
    """The limits of a row as text: rms error, largest error, excursion; empty for a row without limits."""
    given = (
        (row.at_most, "{:g} m"),
        (row.largest, "largest {:g} m"),
        (row.excursion, "excursion {:g}"),
        (row.legs_at_most, "legs {:g} m"),
    )
    return ", ".join(form.format(value) for value, form in given if value is not None)


def verdict(outcome: LawRun) -> str:
    """`hit` or `miss`; empty for a row without limits."""
    return "" if not limits(outcome.row) else "hit" if outcome.hit else "miss"


def overview_cell(outcome: LawRun) -> str:
    """The rms position error of a run, that on its planned legs and its verdict, for the overview."""
    if outcome.metrics is None:
        return f"stopped {verdict(outcome)}".strip()
    legs = outcome.metrics.legs
    off = "" if legs is None else f", legs {quantity(legs, 'm')}"
    return f"{quantity(outcome.metrics.position_rms, 'm')}{off} {verdict(outcome)}".strip()


CELLS: dict[str, Callable[[LawRun], str]] = {
    "rms position error": overview_cell,
    "largest position error": lambda outcome: quantity(outcome.metrics.position_largest, "m") if outcome.metrics else "",
    "actuator travel [1/min]": lambda outcome: quantity(outcome.metrics.travel) if outcome.metrics else "",
}
"""What the tables of all rows show of a run."""


def table(row: Row, outcomes: Sequence[LawRun]) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of one row; a row without limits has no column of verdicts."""
    # One unit for a column, by its largest value: kN for a ship, N for a small boat.
    columns = zip(*(numbers(outcome.metrics) for outcome in outcomes if outcome.metrics), strict=True)
    largest = [max((abs(value) for value in column if math.isfinite(value)), default=0.0) for column in columns]
    scales = [scaled(size, unit) for size, (_, unit) in zip(largest or [0.0] * len(NUMBERS), NUMBERS, strict=True)]
    head = ["law", "Hz", *(f"{name} {unit}".strip() for (name, _), (_, unit) in zip(NUMBERS, scales, strict=True)), "verdict"]
    lines = [cells(outcome, [factor for factor, _ in scales]) for outcome in outcomes]
    # No column of legs where no run has any, and none of verdicts without limits.
    without = [len(head) - 2] * (not largest or not largest[-1]) + [len(head) - 1] * (not limits(row))
    shown = [[cell for i, cell in enumerate(line) if i not in without] for line in (head, *lines)]
    return shown[0], shown[1:]


def numbers(metrics: LawMetrics) -> list[float]:
    """The metrics as numbers, NaN for those that a run does not have."""
    return [math.nan if value is None else value for value in metrics]


def cells(outcome: LawRun, factors: Sequence[float]) -> list[str]:
    """The cells of a run in the table of its row, its metrics multiplied by the factors of their columns."""
    head = [outcome.law, f"{outcome.rate_hz:g}"]
    if outcome.metrics is None:
        return [*head, "stopped", *[""] * (len(NUMBERS) - 1), verdict(outcome)]
    return [
        *head,
        *(quantity(factor * value) for factor, value in zip(factors, numbers(outcome.metrics), strict=True)),
        verdict(outcome),
    ]


def overviews(outcomes: Sequence[LawRun]) -> list[Section]:
    """The rms errors with their verdicts, the largest errors and the actuator travel of all rows.

    Returns a table for each quantity, with a column for each law; a single one with three columns for a single law.
    """
    laws = list(dict.fromkeys(outcome.law for outcome in outcomes))
    rows = [(row, {outcome.law: outcome for outcome in of_row}) for row, of_row in by_row(outcomes)]
    # No column of limits where no row has any: narrow screens need the space.
    limited = any(limits(row) for row, _ in rows)
    names = [[row.name, row.over.replace("_", " "), *([limits(row)] if limited else [])] for row, _ in rows]
    cells = {title: [[cell(of[law]) if law in of else "" for law in laws] for _, of in rows] for title, cell in CELLS.items()}
    head = ["case", "over", *(["limit"] if limited else [])]
    rest = [name[:2] for name in names]  # of the other quantities: the limits are those of the first
    if len(laws) == 1:
        lines = [list(chain(*line)) for line in zip(names, *cells.values(), strict=True)]
        return [Section(laws[0], head=[*head, *CELLS], lines=lines, texts=len(head))]
    first, *others = cells.items()
    shown = [(first, head, names), *((other, head[:2], rest) for other in others)]
    return [
        Section(title, head=top + laws, lines=[*map(list.__add__, left, lines)], texts=len(top))
        for (title, lines), top, left in shown
    ]


def findings(outcomes: Sequence[LawRun]) -> list[str]:
    """How the laws compare in a sentence for each row, or for each law on many rows with limits."""
    laws, rows = dict.fromkeys(outcome.law for outcome in outcomes), by_row(outcomes)
    limited = [outcome for outcome in outcomes if limits(outcome.row)]
    if limited and len(rows) > MAX_FINDINGS:
        counts = {law: [outcome.hit for outcome in limited if outcome.law == law] for law in laws}
        return [f"{law} meets {sum(hits)} of {len(hits)} limits." for law, hits in counts.items() if hits]
    return [_ranking(row, of_row) for row, of_row in rows[:MAX_FINDINGS]] if len(laws) > 1 else []


def _ranking(row: Row, outcomes: Sequence[LawRun]) -> str:
    """The laws on a row in the order of their errors; a law that stopped comes last."""
    errors = {outcome.law: outcome.metrics.position_rms if outcome.metrics else math.inf for outcome in outcomes}
    best, *others = sorted(errors, key=lambda law: errors[law])
    texts = {law: f"{quantity(error, 'm')} rms" if math.isfinite(error) else "stopped" for law, error in errors.items()}
    return f"On {row.name} {best} is the most accurate ({texts[best]}), before {', '.join(f'{o} ({texts[o]})' for o in others)}."


def notes(outcomes: Sequence[LawRun]) -> list[str]:
    """Notes on the tables: laws that ran at another rate, and runs that ended early."""
    other = {o.law: o.rate_hz for o in outcomes if o.fell_back}
    rates = [f"{law} is unstable at the requested rate and ran at {rate:g} Hz" for law, rate in other.items()]
    return rates + [f"{o.law} on {o.row.name}: {o.failure}" for o in outcomes if o.failure]


def write(folder: Path, outcomes: Sequence[LawRun]) -> None:
    """Write compare.html, compare.md, compare.json and figures/*.png into an existing folder."""
    names = {row.name: file_name(row.name) for row, _ in by_row(outcomes)}
    with writing(f"results in {folder}"):
        (folder / "figures").mkdir(exist_ok=True)
        drawn = {row.name: figures_of(row, of_row) for row, of_row in by_row(outcomes)}
        for name, figures in drawn.items():
            draw(folder / "figures" / f"{names[name]}.png", figures)
        (folder / "compare.html").write_text(render(outcomes, drawn), encoding="utf-8")
        (folder / "compare.md").write_text(_markdown(outcomes, names), encoding="utf-8")
        document = {**provenance(), "runs": [_record(outcome) for outcome in outcomes]}
        (folder / "compare.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def render(outcomes: Sequence[LawRun], drawn: Mapping[str, Sequence[Figure]]) -> str:
    """The page: tables of all cases, then each case with its figures and its table."""
    rows, laws = by_row(outcomes), dict.fromkeys(outcome.law for outcome in outcomes)
    sections = [each._replace(title=_capitalised(each.title)) for each in overviews(outcomes)] if len(rows) > 1 else []
    for row, of_row in rows:
        head, lines = table(row, of_row)
        about = f"{_scope(row)}; rms effort over the whole run."
        sections.append(Section(row.name, about, head=head, lines=lines, figures=drawn[row.name]))
    about = f"{len(outcomes)} runs, offline · {', '.join(laws)}"
    more = f" and {len(rows) - MAX_FINDINGS} more" if len(rows) > MAX_FINDINGS else ""
    title = f"Laws compared: {', '.join(row.name for row, _ in rows[:MAX_FINDINGS])}{more}"
    return render_sections(title, [about], sections, [*findings(outcomes), *notes(outcomes)])


def _capitalised(title: str) -> str:
    return f"{title[0].upper()}{title[1:]}"


def _scope(row: Row) -> str:
    """The part of the run to which the errors of a row refer, and their limits."""
    return f"Errors over the {row.over.replace('_', ' ')}{f', at most {limits(row)}' if limits(row) else ''}"


def _markdown(outcomes: Sequence[LawRun], names: dict[str, str]) -> str:
    parts = ["# Laws compared"]
    for overview in overviews(outcomes):
        parts += [f"\n{_capitalised(overview.title)}\n", *_table(overview.head, overview.lines)]
    parts += ["", *(f"- {note}" for note in notes(outcomes))]
    for row, of_row in by_row(outcomes):
        parts += [f"\n## {row.name}\n", f"{_scope(row)}; effort over the whole run.\n"]
        parts += [*_table(*table(row, of_row)), f"\n![{row.name}](figures/{names[row.name]}.png)"]
    return "\n".join(parts) + "\n"


def _table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *lines)]


def _record(outcome: LawRun) -> dict[str, Any]:
    row = outcome.row
    metrics = outcome.metrics._asdict() if outcome.metrics else {}
    return {
        "case": row.name,
        "scenario": row.scenario,
        "set": {name: list(value) if isinstance(value, tuple) else value for name, value in row.changes.items()},
        "over": row.over,
        "limits": {"at_most": row.at_most, "largest": row.largest, "excursion": row.excursion, "legs_at_most": row.legs_at_most},
        "law": outcome.law,
        "rate_hz": outcome.rate_hz,
        "failure": outcome.failure,
        **{name: value if value is not None and math.isfinite(value) else None for name, value in metrics.items()},
        "excursion": outcome.verdict.excursion if outcome.verdict else None,
        "verdict": verdict(outcome) or None,
    }


def figures_of(row: Row, outcomes: Sequence[LawRun]) -> list[Figure]:
    """The tracks of all laws with the reference, and their position errors over time."""
    drawn = [outcome for outcome in outcomes if len(outcome.lines)]
    lines = looks(outcome.law for outcome in drawn)
    tracks: list[Figure] = []
    errors: list[Figure] = []
    for outcome in drawn:
        time, x, y, _, _, error = outcome.lines.T
        look: Any = {**lines[outcome.law], "width": 1.5}
        tracks += [line(x, y, outcome.law, **look), points(x[:1], y[:1], "", "--shared", size=5.0)]
        errors.append(line(time, error.clip(1e-5), outcome.law, **look))  # clipped: a logarithmic axis has no zero
    if drawn:
        reference = drawn[0].lines.T
        tracks.append(line(reference[3], reference[4], "reference", "--ink", width=1.4, dash="dash"))
    plane = layout(Axis("x east [m]"), Axis("y north [m]"), 420, legend=True)
    plane["yaxis"] |= {"scaleanchor": "x"}
    over_time = layout(Axis("time [s]"), Axis("position error [m]", logarithmic=True), 420, legend=True)
    if row.at_most is not None:
        over_time["shapes"] = [level(row.at_most, "--ink", "dot", "limit")]
    return [
        {"title": row.name, "traces": tracks, "layout": plane},
        {"title": "Position error", "traces": errors, "layout": over_time},
    ]
