"""A run as people look at it: a table, figures, one page."""

import base64
import html
from collections.abc import Sequence
from typing import Any

from vessel_hsmc_ros.metrics import Metrics
from vessel_hsmc_ros.run_data import Run
from vessel_hsmc_ros.run_folder import RunFolder

Row = tuple[str, str]

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #1b1f23 }}
table {{ border-collapse: collapse; margin: 1rem 0 }}
td {{ padding: .2rem 1.5rem .2rem 0; border-bottom: 1px solid #d8dee4 }}
td + td {{ text-align: right; font-variant-numeric: tabular-nums }}
img {{ max-width: 100%; margin: 1rem 0 }}
</style></head><body>
<h1>{title}</h1>
<table>{rows}</table>
{images}
</body></html>
"""


def rows(metrics: Metrics, facts: dict[str, Any]) -> list[Row]:
    """The table of a run: what, and how much."""
    m = metrics
    table = [
        ("position error, rms", f"{m.position_error_rms:.4g} m"),
        ("position error, rms of the last quarter", f"{m.position_error_rms_last_quarter:.4g} m"),
        ("position error, final", f"{m.position_error_final:.4g} m"),
        ("heading error, rms", f"{m.heading_error_rms_deg:.4g}°"),
        ("heading error, final", f"{m.heading_error_final_deg:.4g}°"),
        ("surge force, peak", f"{m.surge_force_peak:.4g} N"),
        ("surge force, rms", f"{m.surge_force_rms:.4g} N"),
        ("yaw moment, peak", f"{m.yaw_moment_peak:.4g} N·m"),
        ("yaw moment, rms", f"{m.yaw_moment_rms:.4g} N·m"),
    ]
    shown = {
        "missed_periods": ("control periods missed", "{}"),
        "control_interval_deviation_max": ("control interval, largest deviation", "{:.2g} s"),
        "messages_recorded": ("messages recorded", "{}"),
        "messages_dropped": ("messages dropped", "{}"),
        "start_up": ("from the command to the first control step", "{:.2f} s"),
        "real_time_factor": ("times faster than real time", "{:.1f}"),
    }
    return table + [(label, form.format(facts[key])) for key, (label, form) in shown.items() if facts.get(key) is not None]


def write(folder: RunFolder, title: str, run: Run, table: Sequence[Row]) -> None:
    """Draw a run's figures and write its page, which needs nothing but itself."""
    from vessel_hsmc_ros import figures  # matplotlib takes longer to load than the nodes take to start

    folder.figures.mkdir(exist_ok=True)
    paths = figures.draw(run, folder.figures)
    images = "\n".join(
        f'<img alt="{path.stem}" src="data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}">' for path in paths
    )
    cells = "\n".join(f"<tr><td>{html.escape(label)}</td><td>{html.escape(value)}</td></tr>" for label, value in table)
    page = _PAGE.format(title=html.escape(title), rows=cells, images=images)
    folder.report.write_text(page, encoding="utf-8")
