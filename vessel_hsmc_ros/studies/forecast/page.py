"""The page of a forecast: the tracks of all runs, a table of the legs, the distributions; and the numbers as JSON."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vessel_hsmc_ros.core.quantities import number, quantity
from vessel_hsmc_ros.guidance.planned_track import ComplexArray, outline
from vessel_hsmc_ros.report.diagrams import INK, LIMIT, NEUTRAL, PLANNED, REFERENCE, SHIP, figure
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.studies.forecast.forecast import QUANTILES, Conditions, Forecast, band, summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BINS, PLACES = 24, 160  # of a histogram, and along a leg at which its band is drawn
SHOWN_RANGE = (0.01, 0.99)  # shares of the runs between which a histogram is drawn
HEADROOM = 0.35  # above the plan, for the arrows
ROOM = 0.15  # around the plan and around a band, relative to their size
UNITS = {"time": "s", "energy_wh": "W·h", "battery_left_wh": "W·h", "distance": "m"}
NAMES = {
    "time": "time until the last waypoint",
    "energy_wh": "energy until then",
    "battery_left_wh": "left in the battery",
    "distance": "largest distance from the path",
}
BAND = [f"{100.0 * each:g} %" for each in QUANTILES]


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
    tracks, bars = BytesIO(), BytesIO()
    draw_tracks(found, tracks)
    draw_distributions(found, bars)
    with writing(f"forecast in {folder}"):
        files["page"].write_text(render(found, tracks.getvalue(), bars.getvalue()), encoding="utf-8")
        files["picture"].write_bytes(tracks.getvalue())
        files["numbers"].write_text(json.dumps(_document(found), indent=1) + "\n", encoding="utf-8")
    return files


def render(found: Forecast, tracks: bytes, bars: bytes) -> str:
    """The HTML text of the page."""
    worst = found.plan.legs[found.worst_leg].number + 1
    head, lines = table(found)
    power = found.plan.scenario.vessel_sim.vessel.power
    energy = "Energy by the declared power at full thrust" if power.full_thrust else "Energy estimated: no power is declared"
    sections = [
        Section("Tracks", f"All runs over the planned legs; leg {worst} has the largest distance from the path.", tracks),
        Section("Legs", "Largest distance from each leg and the turn behind it.", b"", head, lines, marked=[str(worst)]),
        Section("Time, energy, distance", f"{energy}. Dashed: 5, 50 and 95 % of the runs.", bars, *overview(found)),
    ]
    title = f"Forecast: {found.plan.scenario.name}"
    return render_sections(title, [f"{len(found.runs)} runs, seed {found.seed}"], sections, verdict(found))


def draw_tracks(found: Forecast, target: Path | BytesIO) -> None:
    """Draw the tracks over the legs with wind and current, and the distances along the worst leg."""
    with figure(target, 11.0, 4.8) as picture:
        tracks, zoom = picture.subplots(1, 2, width_ratios=(3, 2))
        plan, worst = found.plan, found.plan.legs[found.worst_leg]
        lines = outline(plan.track, 2000)
        for line in lines:
            tracks.plot(line.real, line.imag, color=PLANNED, lw=5.0)
        tracks.plot(*_xy([worst.begin, worst.end]), color=LIMIT, lw=5.0, alpha=0.6)
        for run in found.runs:
            colour, strength = (REFERENCE, 0.5) if run.failure else (SHIP, 0.12)
            tracks.plot(run.way[:, 0], run.way[:, 1], color=colour, lw=0.8, alpha=strength)
        for leg in plan.legs:
            x, y = _xy([0.5 * (leg.begin + leg.end)])
            box: Any = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none"}
            tracks.annotate(str(leg.number + 1), (x[0], y[0]), ha="center", va="center", fontsize=8, bbox=box)
        failed = "; failed ones in orange" if found.failed else ""
        title = f"{len(found.runs)} runs{failed}; worst leg {worst.number + 1} in red"
        tracks.set(xlabel="x east [m]", ylabel="y north [m]", title=title)
        tracks.set_aspect("equal", adjustable="box")
        _frame(tracks, np.concatenate(lines))
        _arrows(tracks, plan.conditions)
        _draw_leg(zoom, found)


def _xy(points: Sequence[complex]) -> tuple[list[float], list[float]]:
    return [point.real for point in points], [point.imag for point in points]


def _frame(axes: "Axes", line: ComplexArray) -> None:
    """Show the plan with room around it, however far a failed run has come."""
    size = max(float(np.ptp(line.real)), float(np.ptp(line.imag)), 1.0)
    for set_limits, values, above in ((axes.set_xlim, line.real, ROOM), (axes.set_ylim, line.imag, HEADROOM)):
        set_limits(float(values.min()) - ROOM * size, float(values.max()) + above * size)


def _arrows(axes: "Axes", c: Conditions) -> None:
    """Arrows of wind and current above the tracks."""
    arrows = (("wind", c.wind, c.wind_towards, NEUTRAL), ("current", c.current, c.current_towards, SHIP))
    for k, (name, speed, towards, colour) in enumerate(arrows):
        if speed:
            place = np.array([0.07, 0.92 - 0.1 * k])
            half = 0.035 * np.array([towards.real, towards.imag])
            look: Any = {"arrowstyle": "-|>", "color": colour, "lw": 2.0}
            axes.annotate("", tuple(place + half), tuple(place - half), "axes fraction", "axes fraction", arrowprops=look)
            axes.text(0.13, place[1], f"{name} {quantity(speed, 'm/s')}", color=colour, va="center", transform=axes.transAxes)


def _draw_leg(axes: "Axes", found: Forecast) -> None:
    """The band of the distances along the worst leg and the turn behind it."""
    leg = found.plan.legs[found.worst_leg]
    axes.set(
        xlabel="along the path [m]", ylabel="distance from the path, to port [m]", title=f"Leg {leg.number + 1}, and its turn"
    )
    ways = [run.way[run.way[:, 2] == found.worst_leg] for run in found.runs]
    lines = [(np.maximum.accumulate(way[:, 3]) - leg.way, way[:, 4]) for way in ways if len(way)]
    if not lines:
        return
    for x, y in lines:
        axes.plot(x, y, color=SHIP, lw=0.6, alpha=0.15)
    places = np.linspace(0.0, float(np.median([x[-1] for x, _ in lines])), PLACES)
    curves = np.array([np.interp(places, x, y, left=np.nan, right=np.nan) for x, y in lines])
    low, middle, high = np.array([band(column) for column in curves.T]).T
    axes.fill_between(places, low, high, color=SHIP, alpha=0.4, lw=0, zorder=3, label="5 to 95 % of the runs")
    axes.plot(places, middle, color=INK, lw=1.0, zorder=4, label="median")
    reach = (1.0 + ROOM) * float(np.nanmax(np.abs([low, high]))) or 1.0  # in calm water a straight leg has no distance
    axes.set_ylim(-reach, reach)
    axes.legend(loc="best")


def draw_distributions(found: Forecast, target: Path | BytesIO) -> None:
    """Draw histograms of what the runs took, with the band of each."""
    columns = {
        "time": found.time,
        "energy_wh": found.energy,
        "distance": np.nanmax(np.column_stack((found.worst, np.zeros(len(found.runs)))), axis=1),
    }
    with figure(target, 11.0, 2.8) as picture:
        for axes, (name, values) in zip(picture.subplots(1, 3), columns.items(), strict=True):
            if len(values):  # outliers are counted in the outermost bins, where they leave room for the rest
                low, high = np.quantile(values, SHOWN_RANGE)
                axes.hist(np.clip(values, low, high), bins=BINS, color=SHIP)
            for value in band(values):
                axes.axvline(value, color=INK, lw=1.0, ls="--")
            axes.set(xlabel=f"{NAMES[name]} [{UNITS[name]}]", ylabel="runs")
            axes.locator_params(axis="x", nbins=4)


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
