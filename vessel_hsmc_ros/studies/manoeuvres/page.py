"""The page of a ship's manoeuvres, without external resources, with its diagrams; the metrics as CSV; the scenarios."""

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vessel_hsmc_ros.core.hull import Hull, outline
from vessel_hsmc_ros.core.quantities import quantity, scaled
from vessel_hsmc_ros.report import page_kit
from vessel_hsmc_ros.report.diagrams import Axis, Figure, layout, line
from vessel_hsmc_ros.scenario.scenario import dump_scenario
from vessel_hsmc_ros.studies.manoeuvres.metrics import Track, crossing, speed_curve, spiral_curve
from vessel_hsmc_ros.studies.manoeuvres.run import Manoeuvre, Results
from vessel_hsmc_ros.studies.manoeuvres.tables import APPLIES, SOURCE, TITLES, UNITS, criteria, hull_data, notes, rows, source


def write(folder: Path, results: Results) -> dict[str, Path]:
    """Write manoeuvres.html, manoeuvres.csv and a scenario for each manoeuvre, which the nodes can run, into an existing folder.

    Raises ReportError if a file cannot be written.
    """
    files = {"page": folder / "manoeuvres.html", "metrics": folder / "manoeuvres.csv", "scenarios": folder / "scenarios"}
    with page_kit.writing(f"results in {folder}"):
        files["scenarios"].mkdir(exist_ok=True)
        for name, done in results.manoeuvres.items():
            (files["scenarios"] / f"{name}.yaml").write_text(dump_scenario(done.scenario), encoding="utf-8")
        write_csv(files["metrics"], results)
        files["page"].write_text(render(results, files["scenarios"]), encoding="utf-8")
    return files


def write_csv(path: Path, results: Results) -> None:
    """Write a row for each metric: manoeuvre, metric, value in SI units and degrees, unit, in lengths, limit of its criterion."""
    length = results.ship.length
    limits = {(each.manoeuvre, each.metric): each.limit for each in criteria(length, results.ship.speed)}
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["manoeuvre", "metric", "value", "unit", "in_lengths", "limit", "complete"])
        for name, done in results.manoeuvres.items():
            for metric, value in done.metrics.items():
                unit = UNITS[metric]
                lengths = value / length if unit == "m" else ""
                writer.writerow([name, metric, value, unit, lengths, limits.get((name, metric), ""), done.complete])


def render(results: Results, scenarios: Path) -> str:
    """Render the HTML text of the page.

    `scenarios`: the folder of their scenarios, for the command that runs one over the nodes.
    """
    ship, lines = results.ship, rows(results)
    figures = {name: drawn for name, done in results.manoeuvres.items() if (drawn := figure(done))}
    about = [subtitle(results), *([f"Hull data: {published}"] if (published := source(results)) else [])]
    return page_kit.render(
        "studies/manoeuvres/manoeuvres.html",
        f"Standard manoeuvres: {ship.name}",
        about,
        scripts=(*page_kit.DIAGRAM_SCRIPTS, "studies/manoeuvres/manoeuvres.js"),
        content={"figures": figures},
        titles=TITLES,
        manoeuvres=results.manoeuvres,
        notes={name: list(notes(done)) for name, done in results.manoeuvres.items()},
        rows={name: [row for row in lines if row.manoeuvre == name] for name in results.manoeuvres},
        judged=[row for row in lines if row.limit],
        hull=hull_data(results),
        figures=figures,
        scenarios=scenarios,
        criteria=SOURCE,
        applies=APPLIES,
    )


def subtitle(results: Results) -> str:
    """The ship and its test speed in a line."""
    ship = results.ship
    limits = f"up to {quantity(ship.largest_force, 'N')} and {quantity(ship.largest_moment, 'N·m')}"
    speeds = f"test speed {quantity(ship.speed, 'm/s')} of {quantity(ship.top_speed, 'm/s')}"
    return f"{quantity(ship.length, 'm')} long · {limits} · {speeds} · still water, first turn to starboard"


SHIP, COMMAND, LIMIT = "--run-0", "--run-1", "--limit"


def figure(done: Manoeuvre) -> Figure | None:
    """Traces and layout of a manoeuvre; None for one that failed."""
    return None if done.failure else FIGURES[done.scenario.controller.manoeuvre.kind](done)


def turning_circle(done: Manoeuvre) -> Figure:
    """The track with advance, transfer, tactical and steady diameter, and the hull at every 90°."""
    track, m = done.track, done.metrics
    vessel = done.scenario.vessel_sim.vessel
    traces = [line(track.aside, track.ahead, "track", SHIP)]
    for angle in range(0, 361, 90):
        traces.append(_hull(track.at(crossing(track.turned, math.radians(angle))), Hull(vessel.length, vessel.beam)))
    quarter, half = (track.at(crossing(track.turned, math.radians(angle))) for angle in (90.0, 180.0))
    low = min(0.0, float(track.ahead.min()))
    # The circle of the steady turn, at the end of the track.
    level = float(track.ahead[track.turned > track.turned[-1] - 2.0 * math.pi].mean())
    middle = float(track.aside[track.turned > track.turned[-1] - 2.0 * math.pi].mean())
    radius = 0.5 * m["steady_diameter"]
    traces += [
        *_dimension("advance", m["advance"], (0.0, 0.0), (0.0, m["advance"])),
        *_dimension("transfer", m["transfer"], (0.0, m["advance"]), (float(quarter.aside), m["advance"])),
        *_dimension("steady diameter", m["steady_diameter"], (middle - radius, level), (middle + radius, level)),
        *_dimension("tactical diameter", m["tactical_diameter"], (0.0, low), (m["tactical_diameter"], low)),
        line(np.array([half.aside, half.aside]), np.array([low, half.ahead]), "", "--limit", dash="dot", width=1.0),
    ]
    drawn = layout(Axis("to the side of the turn [m]"), Axis("along the original course [m]"), 520)
    drawn["yaxis"] |= {"scaleanchor": "x"}
    return {"traces": traces, "layout": drawn}


def zigzag(done: Manoeuvre) -> Figure:
    """Change of heading and rudder angle over time, with the overshoots."""
    track, settings = done.track, done.scenario.controller.manoeuvre
    limit = done.scenario.controller.vessel.yaw_moment_limit
    part = track.time <= _zigzag_end(track)
    heading, rudder = np.degrees(track.turned), 35.0 / limit * track.command
    traces = [
        line(track.time[part], heading[part], "change of heading", SHIP),
        line(track.time[part], rudder[part], "rudder angle", COMMAND, shape="hv"),
    ]
    drawn = layout(Axis("time since the execute [s]"), Axis("[°], positive to the side of the first turn"), 380, legend=True)
    executes = np.flatnonzero(np.diff(np.sign(track.command))) + 1
    for k, (name, begin) in enumerate(zip(("first_overshoot", "second_overshoot"), executes[:2], strict=False)):
        if math.isfinite(value := done.metrics[name]):
            sign = 1.0 if k == 0 else -1.0
            edge, time = sign * settings.switch_heading_deg, float(track.time[begin] + done.metrics[f"{name[:-9]}yaw_check_time"])
            traces.append(line(np.array([time, time]), np.array([edge, edge + sign * value]), "", LIMIT))
            drawn["annotations"].append(_note(time, edge + sign * value, f"{value:.3g}°", above=k == 0))
    return {"traces": traces, "layout": drawn}


def _zigzag_end(track: Track) -> float:
    """The time of the fifth reversal, or of half a turn by a ship that goes on turning, or the end."""
    executes = np.flatnonzero(np.diff(np.sign(track.command)))
    around = np.flatnonzero(np.abs(track.turned) > math.pi)
    last = executes[4] if len(executes) > 4 else around[0] if len(around) else -1
    return float(track.time[last])


def spiral(done: Manoeuvre) -> Figure:
    """Steady yaw rate over rudder angle, on the way out and back."""
    settings = done.scenario.controller.manoeuvre
    curve, n = spiral_curve(done.track, settings), settings.steps
    traces = [
        line(curve[:n, 0], curve[:n, 1], "from the first side to the other", SHIP, mode="lines+markers"),
        line(curve[n - 1 :, 0], curve[n - 1 :, 1], "and back", COMMAND, mode="lines+markers", dash="dash"),
    ]
    return {"traces": traces, "layout": layout(Axis("rudder angle [°]"), Axis("steady yaw rate [°/s]"), 380, legend=True)}


def crash_stop(done: Manoeuvre) -> Figure:
    """Speed over the distance along the path."""
    track, m = done.track, done.metrics
    end = crossing(-track.u, 0.0)
    last = len(track.time) if math.isnan(end) else math.ceil(end) + 1
    traces = [line(track.travelled[:last], track.u[:last], "speed", SHIP)]
    drawn = layout(Axis("track reach [m]"), Axis("surge speed [m/s]"), 380)
    if math.isfinite(m["track_reach"]):
        text = f"{quantity(m['track_reach'], 'm')} in {quantity(m['stopping_time'], 's')}"
        drawn["annotations"].append(_note(m["track_reach"], 0.0, text, above=True) | {"xanchor": "right"})
    return {"traces": traces, "layout": drawn}


def speed_run(done: Manoeuvre) -> Figure:
    """Surge force over steady speed."""
    curve = speed_curve(done.track, done.scenario.controller.manoeuvre)
    force = done.scenario.controller.vessel.surge_force_limit
    factor, unit = scaled(force, "N")
    speed, pull = np.concatenate(([0.0], curve[:, 1])), np.concatenate(([0.0], factor * force * curve[:, 0]))
    drawn = layout(Axis("steady speed [m/s]"), Axis(f"surge force [{unit}]"), 380)
    return {"traces": [line(speed, pull, "surge force", SHIP, mode="lines+markers")], "layout": drawn}


def bollard_pull(done: Manoeuvre) -> Figure:
    """The applied force over time."""
    track = done.track
    factor, unit = scaled(float(track.force[-1]), "N")
    drawn = layout(Axis("time [s]"), Axis(f"surge force [{unit}]"), 380)
    drawn["yaxis"] |= {"rangemode": "tozero"}
    return {"traces": [line(track.time, factor * track.force, "applied force", SHIP)], "layout": drawn}


FIGURES: dict[str, Callable[[Manoeuvre], Figure]] = {
    each.__name__: each for each in (turning_circle, zigzag, spiral, crash_stop, speed_run, bollard_pull)
}
"""The diagram of each kind of manoeuvre."""


def _dimension(name: str, value: float, begin: tuple[float, float], end: tuple[float, float]) -> list[Figure]:
    """A dimension line between two points of a track with its name and value in the middle; none for what was not reached."""
    if not math.isfinite(value):
        return []
    x, y = np.array([begin, end]).T
    dimension = line(x, y, "", LIMIT, width=1.5, mode="lines+markers")
    text = {
        "type": "scatter",
        "mode": "text",
        "x": [float(x.mean())],
        "y": [float(y.mean())],
        "text": [f" {name} {quantity(value, 'm')}"],
        "textposition": "middle right" if x[0] == x[1] else "bottom center" if y[0] <= 0.0 else "top center",
        "textfont": {"color": LIMIT, "size": 11},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    return [dimension, text]


def _hull(point: Track, hull: Hull) -> Figure:
    """The outline of the hull at a point of the track."""
    corners = outline(hull)
    c, s = np.cos(point.turned), np.sin(point.turned)
    # x ahead and y to port in the body frame; the track is seen from the side of the turn, which may be the other one.
    ahead, aside = point.ahead + c * corners[:, 0] - s * corners[:, 1], point.aside + s * corners[:, 0] + c * corners[:, 1]
    trace = line(np.append(aside, aside[0]), np.append(ahead, ahead[0]), "", SHIP, width=1.0)
    return {**trace, "fill": "toself", "fillcolor": f"{SHIP}/0.25"}


def _note(x: float, y: float, text: str, above: bool) -> Figure:
    anchor = {"yanchor": "bottom" if above else "top"}
    return {"x": x, "y": y, "text": text, "showarrow": False, "font": {"color": LIMIT, "size": 12}, **anchor}
