"""`make golden`: run every scenario and every part, show the differences from what is recorded, and record it."""

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from golden import parts
from golden.record import FOLDER, Record, changed_metrics, deviations, load, record_of, save

from vessel_hsmc_ros.scenario.scenario import scenario_names


def changes(old: Record, new: Record) -> list[tuple[str, str, str, str]]:
    """The differences of two golden runs: scenario, quantity, old and new value."""
    name = new["scenario"]
    if not old:
        return [(name, "(golden run)", "none", "recorded")]
    if old["columns"] != new["columns"] or len(old["rows"]) != len(new["rows"]):
        return [(name, "(rows)", f"{len(old['rows'])} rows", f"{len(new['rows'])} rows")]
    found = [
        (name, quantity, shown(before), shown(now)) for quantity, before, now in changed_metrics(old["figures"], new["figures"])
    ]
    ratios = dict(zip(new["columns"], deviations(old["rows"], np.array(new["rows"])), strict=True))
    moved = [
        (name, f"{column}, largest deviation", "within 1", f"{ratio:.3g} x allowed")
        for column, ratio in ratios.items()
        if ratio > 1.0
    ]
    return found + moved


def shown(value: str | float | None) -> str:
    return value if isinstance(value, str) else "-" if value is None else f"{value:.9g}"


def main(names: list[str]) -> None:
    known = scenario_names()
    for stale in sorted(path for path in FOLDER.glob("*.json") if path.stem not in known):
        print(f"{stale.stem}: there is no such scenario any more, removed")
        stale.unlink()
    table = []
    with ProcessPoolExecutor(2) as pool:
        for record in pool.map(record_of, names or known):
            found = changes(load(record["scenario"]), record)
            print(f"{record['scenario']}: {'changed' if found else 'as recorded'}", flush=True)
            if found:
                save(record)
            table += found
    if not names:
        print(*parts.refresh(), sep="\n")
    if table:
        widths = [max(len(row[k]) for row in table) for k in range(4)]
        print()
        for row in [("scenario", "quantity", "old", "new"), *table]:
            print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


if __name__ == "__main__":
    main(sys.argv[1:])
