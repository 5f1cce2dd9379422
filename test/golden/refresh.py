"""`make golden`: run every scenario, show what changed since its golden run, and record that."""

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from golden.record import FOLDER, changed_figures, deviations, load, record_of, save

from vessel_hsmc_ros.scenario.scenario import scenario_names


def changes(old, new):
    """Rows of scenario, quantity, old and new."""
    name = new["scenario"]
    if old is None:
        return [(name, "(golden run)", "none", "recorded")]
    if old["columns"] != new["columns"] or len(old["rows"]) != len(new["rows"]):
        return [(name, "(rows)", f"{len(old['rows'])} rows", f"{len(new['rows'])} rows")]
    found = [(name, *map(shown, change)) for change in changed_figures(old["figures"], new["figures"])]
    ratios = dict(zip(new["columns"], deviations(old["rows"], new_rows(new)), strict=True))
    moved = [
        (name, f"{column}, largest deviation", "within 1", f"{ratio:.3g} x allowed")
        for column, ratio in ratios.items()
        if ratio > 1.0
    ]
    return found + moved


def new_rows(record):
    import numpy as np

    return np.array(record["rows"])


def shown(value):
    return value if isinstance(value, str) else "-" if value is None else f"{value:.9g}"


def main(names):
    known = scenario_names()
    for stale in sorted(path for path in FOLDER.glob("*.json") if path.stem not in known):
        print(f"{stale.stem}: no such scenario any more, removed")
        stale.unlink()
    table = []
    with ProcessPoolExecutor(2) as pool:
        for record in pool.map(record_of, names or known):
            found = changes(load(record["scenario"]), record)
            print(f"{record['scenario']}: {'changed' if found else 'as recorded'}", flush=True)
            if found:
                save(record)
            table += found
    if table:
        widths = [max(len(row[k]) for row in table) for k in range(4)]
        print()
        for row in [("scenario", "quantity", "old", "new"), *table]:
            print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


if __name__ == "__main__":
    main(sys.argv[1:])
