"""A comparison as people look at it: tables, Markdown, JSON, figures."""

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.runs.comparison import Outcome
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.scenario.suite import Row

COLUMNS = ("law", "Hz", "rms m", "largest m", "final m", "heading °", "force kN", "moment MN·m", "rev/s", "verdict")
"""Of a row's table: position errors and rms heading error over the row's window, then what Figures says."""

COLORS = {"hierarchical": "#D55E00", "guided": "#0072B2", "los_pid": "#009E73", "nmpc": "#CC79A7"}
OTHER, REFERENCE = "#E69F00", "#000000"
STYLE: Any = {"figure.dpi": 150, "axes.grid": True, "grid.alpha": 0.3, "font.size": 9, "legend.frameon": False}


def by_row(outcomes: Sequence[Outcome]) -> list[tuple[Row, list[Outcome]]]:
    """The outcomes of each row, rows and laws in the order given."""
    rows: list[tuple[Row, list[Outcome]]] = []
    for outcome in outcomes:
        if not rows or rows[-1][0] != outcome.row:
            rows.append((outcome.row, []))
        rows[-1][1].append(outcome)
    return rows


def limits(row: Row) -> str:
    """What a row asks for, in words; empty when nothing."""
    asked = ((row.at_most, "{:g} m"), (row.largest, "largest {:g} m"), (row.excursion, "excursion {:g}"))
    return ", ".join(form.format(value) for value, form in asked if value is not None)


def verdict(outcome: Outcome) -> str:
    """`hit` or `miss`; empty for a row without limits."""
    return "" if not limits(outcome.row) else "hit" if outcome.hit else "miss"


def figure(outcome: Outcome) -> str:
    """The one figure of a run that the overview shows, with its verdict."""
    if outcome.figures is None:
        return f"stopped {verdict(outcome)}".strip()
    return f"{outcome.figures.position_rms:.2g} m {verdict(outcome)}".strip()


def table(row: Row, outcomes: Sequence[Outcome]) -> tuple[list[str], list[list[str]]]:
    """Head and lines of the table of one row; without limits there are no verdicts."""
    width = len(COLUMNS) if limits(row) else len(COLUMNS) - 1
    return list(COLUMNS[:width]), [cells(outcome)[:width] for outcome in outcomes]


def cells(outcome: Outcome) -> list[str]:
    """A run's line in the table of its row, as COLUMNS."""
    head = [outcome.law, f"{outcome.rate_hz:g}"]
    f = outcome.figures
    if f is None:
        return [*head, "stopped", *[""] * (len(COLUMNS) - 4), verdict(outcome)]
    effort = f.surge_force_rms / 1e3, f.yaw_moment_rms / 1e6
    numbers = (f.position_rms, f.position_largest, f.position_final, f.heading_rms_deg, *effort, f.reversals)
    return [*head, *(f"{number:.3g}" for number in numbers), verdict(outcome)]


def overview(outcomes: Sequence[Outcome]) -> tuple[list[str], list[list[str]]]:
    """Head and lines of the table of all rows and laws."""
    rows = by_row(outcomes)
    laws = list(dict.fromkeys(outcome.law for outcome in outcomes))
    head = ["case", "over", "limit", *laws]
    lines = []
    for row, of_row in rows:
        shown = {outcome.law: figure(outcome) for outcome in of_row}
        lines.append([row.name, row.over.replace("_", " "), limits(row), *(shown.get(law, "") for law in laws)])
    return head, lines


def notes(outcomes: Sequence[Outcome]) -> list[str]:
    """What the tables cannot say: other rates, and runs that stopped."""
    other = {o.law: o.rate_hz for o in outcomes if o.fell_back}
    told = [f"{law} is unstable at the rate asked for and ran at {rate:g} Hz" for law, rate in other.items()]
    return told + [f"{o.law} on {o.row.name}: {o.failure}" for o in outcomes if o.failure]


def write(folder: Path, outcomes: Sequence[Outcome]) -> None:
    """compare.md, compare.json and figures/*.png into a folder."""
    (folder / "figures").mkdir(exist_ok=True)
    names = {row.name: re.sub(r"[^A-Za-z0-9_.-]+", "_", row.name) for row, _ in by_row(outcomes)}
    for row, of_row in by_row(outcomes):
        draw(row, of_row, folder / "figures" / f"{names[row.name]}.png")
    (folder / "compare.md").write_text(_markdown(outcomes, names), encoding="utf-8")
    document = {**provenance(), "runs": [_record(outcome) for outcome in outcomes]}
    (folder / "compare.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def _markdown(outcomes: Sequence[Outcome], names: dict[str, str]) -> str:
    parts = ["# Laws compared\n", "Rms position error.\n", *_table(*overview(outcomes)), ""]
    parts += [f"- {note}" for note in notes(outcomes)]
    for row, of_row in by_row(outcomes):
        asked = f", at most {limits(row)}" if limits(row) else ""
        parts += [f"\n## {row.name}\n", f"Over the {row.over.replace('_', ' ')}{asked}; effort over the whole run.\n"]
        parts += [*_table(*table(row, of_row)), f"\n![{row.name}](figures/{names[row.name]}.png)"]
    return "\n".join(parts) + "\n"


def _table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *lines)]


def _record(outcome: Outcome) -> dict[str, Any]:
    row = outcome.row
    figures = outcome.figures._asdict() if outcome.figures else {}
    return {
        "case": row.name,
        "scenario": row.scenario,
        "set": {name: list(value) if isinstance(value, tuple) else value for name, value in row.changes.items()},
        "over": row.over,
        "limits": {"at_most": row.at_most, "largest": row.largest, "excursion": row.excursion},
        "law": outcome.law,
        "rate_hz": outcome.rate_hz,
        "failure": outcome.failure,
        **{name: value if math.isfinite(value) else None for name, value in figures.items()},
        "excursion": outcome.verdict.excursion if outcome.verdict else None,
        "verdict": verdict(outcome) or None,
    }


def draw(row: Row, outcomes: Sequence[Outcome], path: Path) -> None:
    """Tracks of all laws beside the reference, and their position errors over time."""
    import matplotlib as mpl  # takes longer to load than a law to run a minute
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        picture = Figure(figsize=(10.0, 4.6), layout="constrained")
        tracks, errors = picture.subplots(1, 2)
        drawn = [outcome for outcome in outcomes if len(outcome.lines)]
        for outcome in drawn:
            time, x, y, _, _, error = outcome.lines.T
            look: Any = {"color": COLORS.get(outcome.law, OTHER), "lw": 1.1, "label": outcome.law}
            tracks.plot(x, y, **look)
            tracks.plot(x[0], y[0], "o", color="#555555", ms=4)
            errors.semilogy(time, error.clip(1e-5), **look)
        if drawn:
            reference = drawn[0].lines.T
            tracks.plot(reference[3], reference[4], color=REFERENCE, lw=1.0, ls="--", label="reference")
        if row.at_most is not None:
            errors.axhline(row.at_most, color=REFERENCE, lw=0.8, ls=":", label="limit")
        tracks.set(xlabel="x east [m]", ylabel="y north [m]", title=row.name, aspect="equal")
        tracks.set_adjustable("datalim")
        errors.set(xlabel="time [s]", ylabel="position error [m]", title="Distance to the reference")
        errors.legend(loc="upper right", ncols=2)
        picture.savefig(path)
