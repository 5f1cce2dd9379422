"""The page of the fault matrix: its results, and the picture."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
from fault_judge import LAWS  # type: ignore[import-not-found]

matplotlib.use("svg")

GOOD, BAD, NONE = "#2f9e5b", "#c8342b", "#ececec"
COLUMNS = [(law, mode) for mode in ("lockstep", "real time") for law in LAWS]


def write_page(path: Path, cells: Sequence[Any]) -> None:
    """Write the matrix of the page, between its marks, and the picture beside it.

    Args:
        path: The page, which has the marks.
        cells: The judged cells.
    """
    text = path.read_text(encoding="utf-8")
    begin, end = "<!-- matrix -->\n", "<!-- end of matrix -->"
    path.write_text(text.partition(begin)[0] + begin + matrix(cells) + end + text.partition(end)[2], encoding="utf-8")
    draw(path.parent / "images" / "fault_matrix.svg", cells)


def matrix(cells: Sequence[Any]) -> str:
    """The summary, and a table for each target."""
    bad = sum(bool(cell.problems) for cell in cells)
    parts = [f"{len(cells)} cells, {len(cells) - bad} as expected, {bad} not.\n"]
    for target in dict.fromkeys(cell.target for cell in cells):
        parts.append(f"\n### {target.capitalize()}\n\n{_table([cell for cell in cells if cell.target == target])}")
    if bad:
        parts.append("\n### Not as expected\n\n")
        reasons = Counter("; ".join(c.problems) for c in cells if c.problems)
        parts += [f"- {number} cells: {reason}.\n" for reason, number in reasons.most_common()]
    return "".join(parts)


def _table(cells: Sequence[Any]) -> str:
    present = [column for column in COLUMNS if any((c.law, c.mode) == column for c in cells)]
    head = ["fault", "expected", "why", *(f"{law}, {mode}" for law, mode in present)]
    rows = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for name in dict.fromkeys(cell.name for cell in cells):
        row = {(c.law, c.mode): c for c in cells if c.name == name}
        first = next(iter(row.values()))
        rows.append(f"| {' | '.join([name, first.expect, first.reason, *(_result(row.get(column)) for column in present)])} |")
    return "\n".join(rows) + "\n"


def _result(cell: Any) -> str:
    if cell is None:
        return ""
    if cell.problems:
        return "**no**"
    return f"yes, {cell.recovery:.1f} s"


def draw(path: Path, cells: Sequence[Any]) -> None:
    """Draw a square for each cell: green as expected, red not, grey where there is none."""
    from matplotlib import pyplot as plt

    names = list(dict.fromkeys((c.target, c.name) for c in cells))
    figure, axes = plt.subplots(figsize=(5.4, 0.8 + 0.19 * len(names)), layout="constrained")
    found = {(c.target, c.name, c.law, c.mode): GOOD if not c.problems else BAD for c in cells}
    for row, name in enumerate(names):
        for column, (law, mode) in enumerate(COLUMNS):
            colour = found.get((*name, law, mode), NONE)
            axes.add_patch(plt.Rectangle((column - 0.45, row - 0.42), 0.9, 0.84, color=colour))
    axes.set_xlim(-0.5, len(COLUMNS) - 0.5)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xticks(range(len(COLUMNS)), [f"{law}\n{mode}" for law, mode in COLUMNS], fontsize=6)
    axes.set_yticks(range(len(names)), [f"{target}: {name}" for target, name in names], fontsize=6)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, metadata={"Date": None})
