"""The page of a forecast: the tracks of all runs, a table of the legs, the distributions; and the numbers as JSON."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.quantities import number, quantity
from vessel_hsmc_ros.guidance.planned_track import ComplexArray, outline
from vessel_hsmc_ros.report.diagrams import Axis, Figure, draw, histogram, layout, line, moment, text
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.studies.forecast.forecast import QUANTILES, Conditions, Forecast, band, summary

BINS, PLACES = 24, 160  # of a histogram, and along a leg at which its band is drawn
SHOWN_RANGE = (0.01, 0.99)  # shares of the runs between which a histogram is drawn
HEADROOM = 0.35  # above the plan, for the arrows
PICTURE, ARROW = (6.0, 4.8), 28.0  # width and height of a figure of the picture, inches; length of an arrow, pixels
DRAWN_RUNS = 200  # most tracks in a figure
ROOM = 0.15  # around the plan and around a band, relative to their size
UNITS = {"time": "s", "energy_wh": "W·h", "battery_left_wh": "W·h", "distance": "m"}
NAMES = {
    "time": "time until the last waypoint",
    "energy_wh": "energy until then",
    "battery_left_wh": "left in the battery",
    "distance": "largest distance from the path",
}
BAND = [f"{100.0 * each:g} %" for each in QUANTILES]


BANDS = "Dashed: 5, 50 and 95 % of the runs."


def verdict(found: Forecast) -> list[str]:
    """The answer in sentences: whether to sail, and why runs failed."""
    n = len(found.runs)
    done = n - len(found.failed)
    answer = "Yes" if found.succeeds else "No"
    return [f"{answer}: {done} of {n} runs do the mission in {conditions_in_words(found.plan.conditions)}.", *found.reasons()]


def conditions_in_words(c: Conditions) -> str:
    """Wind and current in words."""
    wind = f"a wind of {quantity(c.wind, 'm/s')} from {number(c.wind_from)}°" if c.wind else "no wind"
    current = f"a current of {quantity(c.current, 'm/s')} to {number(c.current_to)}°" if c.current else "no current"
    return f"{wind} and {current}"


def overview(found: Forecast) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of bands."""
    lines = [[NAMES[name], *(quantity(value, UNITS[name]) for value in values)] for name, values in summary(found).items()]
    return ["", *BAND], lines


def table(found: Forecast) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of the legs."""
    lines = []
    for leg, column in zip(found.plan.legs, found.worst.T, strict=True):
        course = (90.0 - math.degrees(leg.course)) % 360.0
        geometry = [quantity(abs(leg.end - leg.begin), "m"), f"{course:.0f}°", quantity(leg.speed, "m/s")]
        lines.append([str(leg.number + 1), *geometry, *(quantity(value, "m") for value in band(column))])
    return ["leg", "straight part", "course", "speed", *(f"distance {each}" for each in BAND)], lines


def write(folder: Path, found: Forecast) -> dict[str, Path]:
    """Write forecast.html, forecast.json and forecast.png into an existing folder; returns their paths by kind."""
    files = {"page": folder / "forecast.html", "picture": folder / "forecast.png", "numbers": folder / "forecast.json"}
    plane = [tracks(found), worst_leg(found)]
    with writing(f"forecast in {folder}"):
        files["page"].write_text(render(found, plane), encoding="utf-8")
        draw(files["picture"], plane, PICTURE)
        files["numbers"].write_text(json.dumps(_document(found), indent=1) + "\n", encoding="utf-8")
    return files


def render(found: Forecast, plane: Sequence[Figure]) -> str:
    """The HTML text of the page."""
    worst = found.plan.legs[found.worst_leg].number + 1
    head, lines = table(found)
    power = found.plan.scenario.vessel_sim.vessel.power
    energy = "Energy by the declared power at full thrust" if power.full_thrust else "Energy estimated: no power is declared"
    bands, took = overview(found)
    sections = [
        Section("Tracks", f"All runs over the planned legs; leg {worst} has the largest distance from the path.", figures=plane),
        Section("Legs", "Largest distance from each leg and the turn behind it.", head=head, lines=lines, marked=[str(worst)]),
        Section("Time, energy, distance", f"{energy}. {BANDS}", head=bands, lines=took, figures=distributions(found)),
    ]
    title = f"Forecast: {found.plan.scenario.name}"
    return render_sections(title, [f"{len(found.runs)} runs, seed {found.seed}"], sections, verdict(found))


def tracks(found: Forecast) -> Figure:
    """The tracks over the legs, with wind and current."""
    plan, worst = found.plan, found.plan.legs[found.worst_leg]
    lines = outline(plan.track, 2000)
    traces = [line(each.real, each.imag, "", "--plan", width=6.0) for each in lines]
    traces.append(line(*_xy([worst.begin, worst.end]), "", "--limit/0.6", width=6.0))
    failed = [run for run in found.runs if run.failure]
    drawn_runs = [*(run for run in found.runs if not run.failure), *failed][-DRAWN_RUNS:]  # failed ones last, on top
    for run in drawn_runs:
        traces.append(line(run.way[:, 0], run.way[:, 1], "", "--reference/0.5" if run.failure else "--ship/0.12", width=1.0))
    drawn = layout(Axis("x east [m]"), Axis("y north [m]"), 460)
    drawn["yaxis"] |= {"scaleanchor": "x"}
    _frame(drawn, np.concatenate(lines))
    middles = [(leg.number, 0.5 * (leg.begin + leg.end)) for leg in plan.legs]
    drawn["annotations"] = [text(at.real, at.imag, str(number + 1), bgcolor="--card") for number, at in middles]
    drawn["annotations"] += _arrows(plan.conditions)
    orange = f", {len(failed)} failed (orange)" if failed else ""
    return {"title": f"{len(found.runs)} runs{orange}", "traces": traces, "layout": drawn}


def _xy(points: Sequence[complex]) -> tuple[Array, Array]:
    return np.real(points), np.imag(points)


def _frame(drawn: Figure, shown: ComplexArray) -> None:
    """Show the plan with room around it, however far a failed run has come."""
    size = max(float(np.ptp(shown.real)), float(np.ptp(shown.imag)), 1.0)
    for axis, values, above in (("xaxis", shown.real, ROOM), ("yaxis", shown.imag, HEADROOM)):
        drawn[axis]["range"] = [float(values.min()) - ROOM * size, float(values.max()) + above * size]


def _arrows(c: Conditions) -> list[Figure]:
    """Arrows of wind and current above the tracks."""
    arrows = (("wind", c.wind, c.wind_towards, "--shared"), ("current", c.current, c.current_towards, "--ship"))
    found: list[Figure] = []
    for k, (name, speed, towards, colour) in enumerate(arrows):
        if speed:
            place, look = 0.92 - 0.1 * k, {"xref": "paper", "yref": "paper", "font": {"color": colour}}
            tail = {"ax": -ARROW * towards.real, "ay": ARROW * towards.imag}  # of the arrow, to the right and down of its head
            found.append(text(0.1, place, "", **look, arrowhead=2, arrowcolor=colour, **tail) | {"showarrow": True})
            found.append(text(0.14, place, f"{name} {quantity(speed, 'm/s')}", **look, xanchor="left"))
    return found


def worst_leg(found: Forecast) -> Figure:
    """The band of the distances along the worst leg and the turn behind it."""
    leg = found.plan.legs[found.worst_leg]
    ways = [run.way[run.way[:, 2] == found.worst_leg] for run in found.runs]
    curves = [(np.maximum.accumulate(way[:, 3]) - leg.way, way[:, 4]) for way in ways if len(way)]
    drawn = layout(Axis("along the path [m]"), Axis("distance from the path, to port [m]"), 460, legend=bool(curves))
    figure: Figure = {"title": f"Leg {leg.number + 1}, the worst (red), and its turn", "traces": [], "layout": drawn}
    if not curves:
        return figure
    places = np.linspace(0.0, float(np.median([x[-1] for x, _ in curves])), PLACES)
    values = np.array([np.interp(places, x, y, left=np.nan, right=np.nan) for x, y in curves])
    low, middle, high = np.array([band(column) for column in values.T]).T
    filled = {"fill": "tonexty", "fillcolor": "--ship/0.4", "name": "5 to 95 % of the runs", "showlegend": True}
    reach = (1.0 + ROOM) * float(np.nanmax(np.abs([low, high]))) or 1.0  # in calm water a straight leg has no distance
    drawn["yaxis"]["range"] = [-reach, reach]
    figure["traces"] = [
        *(line(x, y, "", "--ship/0.15", width=0.8) for x, y in curves[:DRAWN_RUNS]),
        line(places, low, "", "--ship", width=0),
        {**line(places, high, "", "--ship", width=0), **filled},
        line(places, middle, "median", "--ink", width=1.4),
    ]
    return figure


def distributions(found: Forecast) -> list[Figure]:
    """Histograms of what the runs took, with the band of each."""
    columns = {
        "time": found.time,
        "energy_wh": found.energy,
        "distance": np.nanmax(np.column_stack((found.worst, np.zeros(len(found.runs)))), axis=1),
    }
    figures = []
    for name, values in columns.items():
        drawn = layout(Axis(f"{NAMES[name]} [{UNITS[name]}]"), Axis("runs"), 260)
        drawn["shapes"] = [moment(value, "--ink") for value in band(values) if math.isfinite(value)]
        # Outliers are counted in the outermost bins, where they leave room for the rest.
        clipped = np.clip(values, *np.quantile(values, SHOWN_RANGE)) if len(values) else values
        bars = [histogram(clipped, BINS, "--ship")] if len(values) else []
        figures.append({"title": NAMES[name], "traces": bars, "layout": drawn})
    return figures


def _document(found: Forecast) -> dict[str, Any]:
    """What forecast.json contains; a run that did not arrive has no time and no energy."""

    def finite(values: Sequence[float]) -> list[float | None]:
        return [value if math.isfinite(value) else None for value in values]

    return {
        **provenance(),
        "scenario": found.plan.scenario.name,
        "conditions": asdict(found.plan.conditions),
        "seed": found.seed,
        "corridor": found.plan.corridor,
        "failed": len(found.failed),
        "quantiles": list(QUANTILES),
        "bands": {name: finite(values) for name, values in summary(found).items()},
        "legs": {
            str(leg.number + 1): finite(band(column).tolist()) for leg, column in zip(found.plan.legs, found.worst.T, strict=True)
        },
        "runs": [
            {"failure": run.failure, "time": t, "energy_wh": e, "distances": finite(run.worst.tolist())}
            for run in found.runs
            for t, e in [finite([run.time, run.energy])]
        ],
    }
