"""The results of a comparison of laws: tables, Markdown, JSON, figures."""

import json
import math
import re
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.report.style import INK, NEUTRAL, PLOT, SERIES
from vessel_hsmc_ros.runs.comparison import LawRun
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.scenario.suite import Row

COLUMNS = ("law", "Hz", "rms m", "largest m", "final m", "heading °", "force kN", "moment MN·m", "rev/s", "verdict")
"""Columns of a row's table: position errors, rms heading error, and the other fields of LawMetrics."""

COLOURS = dict(zip(("guided", "hierarchical", "los_pid", "nmpc"), SERIES, strict=False))
"""Colours of the laws, the same in every figure; other laws take the next ones."""


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
    given = ((row.at_most, "{:g} m"), (row.largest, "largest {:g} m"), (row.excursion, "excursion {:g}"))
    return ", ".join(form.format(value) for value, form in given if value is not None)


def verdict(outcome: LawRun) -> str:
    """`hit` or `miss`; empty for a row without limits."""
    return "" if not limits(outcome.row) else "hit" if outcome.hit else "miss"


def overview_cell(outcome: LawRun) -> str:
    """The rms position error of a run with its verdict, for the overview."""
    if outcome.metrics is None:
        return f"stopped {verdict(outcome)}".strip()
    return f"{outcome.metrics.position_rms:.2g} m {verdict(outcome)}".strip()


def table(row: Row, outcomes: Sequence[LawRun]) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of one row; a row without limits has no column of verdicts."""
    width = len(COLUMNS) if limits(row) else len(COLUMNS) - 1
    return list(COLUMNS[:width]), [cells(outcome)[:width] for outcome in outcomes]


def cells(outcome: LawRun) -> list[str]:
    """The cells of a run in the table of its row, in the order of COLUMNS."""
    head = [outcome.law, f"{outcome.rate_hz:g}"]
    m = outcome.metrics
    if m is None:
        return [*head, "stopped", *[""] * (len(COLUMNS) - 4), verdict(outcome)]
    effort = m.surge_force_rms / 1e3, m.yaw_moment_rms / 1e6
    numbers = (m.position_rms, m.position_largest, m.position_final, m.heading_rms_deg, *effort, m.reversals)
    return [*head, *(f"{number:.3g}" for number in numbers), verdict(outcome)]


def overview(outcomes: Sequence[LawRun]) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of all rows and laws."""
    rows = by_row(outcomes)
    laws = list(dict.fromkeys(outcome.law for outcome in outcomes))
    head = ["case", "over", "limit", *laws]
    lines = []
    for row, of_row in rows:
        shown = {outcome.law: overview_cell(outcome) for outcome in of_row}
        lines.append([row.name, row.over.replace("_", " "), limits(row), *(shown.get(law, "") for law in laws)])
    return head, lines


def notes(outcomes: Sequence[LawRun]) -> list[str]:
    """Notes on the tables: laws that ran at another rate, and runs that ended early."""
    other = {o.law: o.rate_hz for o in outcomes if o.fell_back}
    rates = [f"{law} is unstable at the requested rate and ran at {rate:g} Hz" for law, rate in other.items()]
    return rates + [f"{o.law} on {o.row.name}: {o.failure}" for o in outcomes if o.failure]


def write(folder: Path, outcomes: Sequence[LawRun]) -> None:
    """Write compare.md, compare.json and figures/*.png into an existing folder."""
    (folder / "figures").mkdir(exist_ok=True)
    names = {row.name: re.sub(r"[^A-Za-z0-9_.-]+", "_", row.name) for row, _ in by_row(outcomes)}
    for row, of_row in by_row(outcomes):
        draw(row, of_row, folder / "figures" / f"{names[row.name]}.png")
    (folder / "compare.md").write_text(_markdown(outcomes, names), encoding="utf-8")
    document = {**provenance(), "runs": [_record(outcome) for outcome in outcomes]}
    (folder / "compare.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def _markdown(outcomes: Sequence[LawRun], names: dict[str, str]) -> str:
    parts = ["# Laws compared\n", "Rms position error.\n", *_table(*overview(outcomes)), ""]
    parts += [f"- {note}" for note in notes(outcomes)]
    for row, of_row in by_row(outcomes):
        limit = f", at most {limits(row)}" if limits(row) else ""
        parts += [f"\n## {row.name}\n", f"Over the {row.over.replace('_', ' ')}{limit}; effort over the whole run.\n"]
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
        "limits": {"at_most": row.at_most, "largest": row.largest, "excursion": row.excursion},
        "law": outcome.law,
        "rate_hz": outcome.rate_hz,
        "failure": outcome.failure,
        **{name: value if math.isfinite(value) else None for name, value in metrics.items()},
        "excursion": outcome.verdict.excursion if outcome.verdict else None,
        "verdict": verdict(outcome) or None,
    }


def draw(row: Row, outcomes: Sequence[LawRun], path: Path) -> None:
    """Draw the tracks of all laws with the reference, and their position errors over time.

    Args:
        row: The case, whose limit is drawn.
        outcomes: Its runs; those without lines are omitted.
        path: The PNG file.
    """
    import matplotlib as mpl  # imported here: it takes longer than simulating a minute
    from matplotlib.figure import Figure

    with mpl.rc_context(PLOT):
        picture = Figure(figsize=(10.0, 4.6), layout="constrained")
        tracks, errors = picture.subplots(1, 2)
        drawn = [outcome for outcome in outcomes if len(outcome.lines)]
        others = dict.fromkeys(outcome.law for outcome in drawn if outcome.law not in COLOURS)
        colours = COLOURS | dict(zip(others, cycle(SERIES[len(COLOURS) :]), strict=False))
        for outcome in drawn:
            time, x, y, _, _, error = outcome.lines.T
            look: Any = {"color": colours[outcome.law], "lw": 1.1, "label": outcome.law}
            tracks.plot(x, y, **look)
            tracks.plot(x[0], y[0], "o", color=NEUTRAL, ms=4)
            errors.semilogy(time, error.clip(1e-5), **look)  # clipped: a logarithmic axis has no zero
        if drawn:
            reference = drawn[0].lines.T
            tracks.plot(reference[3], reference[4], color=INK, lw=1.0, ls="--", label="reference")
        if row.at_most is not None:
            errors.axhline(row.at_most, color=INK, lw=0.8, ls=":", label="limit")
        tracks.set(xlabel="x east [m]", ylabel="y north [m]", title=row.name, aspect="equal")
        tracks.set_adjustable("datalim")
        errors.set(xlabel="time [s]", ylabel="position error [m]", title="Position error")
        errors.legend(loc="upper right", ncols=2)
        picture.savefig(path)
