"""The page of a ship's manoeuvres: metrics, criteria of IMO resolution MSC.137(76), 5.3, diagrams; and the metrics as CSV."""

import csv
import math
from collections.abc import Callable, Iterator, Sequence
from itertools import compress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.hull import Hull, outline
from vessel_hsmc_ros.core.quantities import number, quantity, scaled
from vessel_hsmc_ros.report.diagrams import Axis, Figure, layout, line
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.scenario.scenario import dump_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.manoeuvres.run import Manoeuvre, Results, Track, crossing, speed_curve, spiral_curve

SOURCE = "IMO resolution MSC.137(76), 5.3"

APPLIES = "applies to ships of 100 m and more"

SHORTEST = 100.0
"""Length of the smallest ships to which the resolution applies, m; to tankers of gas and chemicals of any length."""


class Criterion(NamedTuple):
    """An upper limit of a metric."""

    manoeuvre: str
    metric: str
    limit: float  # in the unit of the metric
    text: str  # the limit as the resolution gives it


def criteria(length: float, speed: float) -> list[Criterion]:
    """The criteria for a ship of a length L, m, with a test speed V, m/s."""
    passage = length / speed
    first, second = overshoot_limits(passage)
    return [
        Criterion("turning_circle", "advance", 4.5 * length, "4.5 L"),
        Criterion("turning_circle", "tactical_diameter", 5.0 * length, "5 L"),
        Criterion("zigzag_10", "initial_turning_distance", 2.5 * length, "2.5 L"),
        Criterion("zigzag_10", "first_overshoot", first, f"{first:.3g}° for L/V = {passage:.3g} s"),
        Criterion("zigzag_10", "second_overshoot", second, f"{second:.3g}° for L/V = {passage:.3g} s"),
        Criterion("zigzag_20", "first_overshoot", 25.0, "25°"),
        Criterion("crash_stop", "track_reach", 15.0 * length, "15 L"),
    ]


def overshoot_limits(passage: float) -> tuple[float, float]:
    """The limits of the first and second overshoot of the 10°/10° zig-zag, in degrees, for L/V in s."""
    # Linear in L/V between 10 s and 30 s, constant below and above.
    within = min(max(passage, 10.0), 30.0)
    return 5.0 + 0.5 * within, 17.5 + 0.75 * within


TITLES = {
    "turning_circle": "Turning circle, rudder 35°",
    "zigzag_10": "Zig-zag 10°/10°",
    "zigzag_20": "Zig-zag 20°/20°",
    "spiral": "Spiral (Dieudonné)",
    "crash_stop": "Crash stop",
    "speed_run": "Speed runs",
    "bollard_pull": "Bollard pull",
}

UNITS = {
    **dict.fromkeys(("advance", "transfer", "tactical_diameter", "steady_diameter", "initial_turning_distance"), "m"),
    **dict.fromkeys(("track_reach", "head_reach", "side_reach"), "m"),
    **dict.fromkeys(("time_90", "time_180", "time_360", "first_yaw_check_time", "second_yaw_check_time"), "s"),
    **dict.fromkeys(("initial_turning_time", "period", "stopping_time", "force_rise_time"), "s"),
    **dict.fromkeys(("steady_speed", "top_speed", "half_force_speed"), "m/s"),
    **dict.fromkeys(("drift_angle", "first_overshoot", "second_overshoot", "loop_width"), "°"),
    **dict.fromkeys(("steady_yaw_rate", "residual_yaw_rate", "largest_yaw_rate"), "°/s"),
    "speed_loss": "%",
    "bollard_pull": "N",
}
"""The unit of each metric."""

LABELS = {
    "time_90": "time to 90°",
    "time_180": "time to 180°",
    "time_360": "time to 360°",
    "drift_angle": "drift angle in the steady turn",
    "loop_width": "width of the loop, rudder angle",
    "residual_yaw_rate": "yaw rate with the rudder amidships",
    "half_force_speed": "speed at half of the force",
    "force_rise_time": "time to 95 % of the force",
}
"""Names of metrics in words, where they are not the names with spaces."""

MARGIN = 1e-3  # share of a range of speeds that counts as inside it: a manoeuvre may begin at its end


HEAD = ["metric", "value", "lengths", "criterion", ""]


class Row(NamedTuple):
    """A metric of a manoeuvre."""

    manoeuvre: str
    metric: str
    # value, unit: in SI units and degrees
    value: float
    unit: str
    lengths: float | None  # the same in ship lengths; None where it is no length
    criterion: Criterion | None

    @property
    def cells(self) -> tuple[str, ...]:
        """The cells under HEAD: name, value with unit, lengths, limit and verdict; empty where there is none."""
        label = LABELS.get(self.metric, self.metric.replace("_", " "))
        lengths = "" if self.lengths is None or not math.isfinite(self.lengths) else number(self.lengths)
        limit = "" if self.criterion is None else self.criterion.text
        return label, shown(self.value, self.unit), lengths, limit, self._verdict()

    def _verdict(self) -> str:
        if self.criterion is None or math.isnan(self.value):
            return ""
        return "within" if self.value <= self.criterion.limit else "beyond"


def rows(results: Results) -> list[Row]:
    """All metrics of a ship."""
    length = results.ship.length
    limits = {(each.manoeuvre, each.metric): each for each in criteria(length, results.ship.speed)}
    return [
        Row(name, metric, value, UNITS[metric], value / length if UNITS[metric] == "m" else None, limits.get((name, metric)))
        for name, metrics in results.metrics.items()
        for metric, value in metrics.items()
    ]


OVERVIEW = (
    ("advance L", "turning_circle", "advance"),
    ("tactical diameter L", "turning_circle", "tactical_diameter"),
    ("steady diameter L", "turning_circle", "steady_diameter"),
    ("10°/10° first °", "zigzag_10", "first_overshoot"),
    ("second °", "zigzag_10", "second_overshoot"),
    ("20°/20° first °", "zigzag_20", "first_overshoot"),
    ("loop °", "spiral", "loop_width"),
    ("track reach L", "crash_stop", "track_reach"),
    ("top m/s", "speed_run", "top_speed"),
)
"""Columns of the table of several ships: name, manoeuvre and metric; lengths in ship lengths."""


def overview(found: Sequence[Results]) -> tuple[list[str], list[list[str]]]:
    """Header and lines of the table of several ships, which have performed all manoeuvres."""
    lines = []
    for results in found:
        cells = []
        for _, manoeuvre, metric in OVERVIEW:
            value = results.metrics.get(manoeuvre, {}).get(metric, math.nan)
            scale = results.ship.length if UNITS[metric] == "m" else 1.0
            cells.append("∞" if math.isinf(value) else "–" if math.isnan(value) else number(value / scale))
        lines.append([results.ship.name, number(results.ship.length), number(results.ship.speed), *cells])
    return ["vessel", "L m", "test m/s", *(name for name, _, _ in OVERVIEW)], lines


def shown(value: float, unit: str) -> str:
    """A metric as text."""
    return "not checked" if math.isinf(value) else "not reached" if math.isnan(value) else quantity(value, unit)


def notes(done: Manoeuvre) -> Iterator[str]:
    """What the reader must know to judge a manoeuvre, a sentence each."""
    if done.failure:
        yield f"The simulation failed: {done.failure}."
        return
    if math.inf in done.metrics.values():
        yield "The rudder does not check the yaw: the ship goes on turning against it."
    if not done.complete:
        yield "Not everything is steady at the end of its step: near the edge of its loop a vessel needs very long to settle."
    hull, track = done.scenario.vessel_sim.vessel, done.track
    # A track is mirrored to the side of its first turn.
    side = 1.0 if done.scenario.controller.manoeuvre.side == "port" else -1.0
    ranges = (
        ("surge speed", "m/s", hull.surge_speed_range, track.u),
        ("sway speed", "m/s", hull.sway_speed_range, side * track.v),
        ("yaw rate", "rad/s", hull.yaw_rate_range, side * track.r),
    )
    for name, unit, (low, high), values in ranges:
        beyond = np.maximum(values - high, low - values)
        if beyond.max() > MARGIN * (high - low):
            reached = float(values[beyond.argmax()])
            yield f"The {name} reaches {reached:.3g} {unit}, outside the range of the hull data, {low:g} to {high:g} {unit}."


def hull_data(results: Results) -> list[tuple[str, str]]:
    """The hull data that are not zero, by name, as texts with their units."""
    hull = results.ship.scenario.vessel_sim.vessel
    values = schema.flatten(hull)
    units = {name: entry.unit for name, entry in schema.entries(type(hull)).items()}
    return [
        (name, f"{value:.6g} {units[name]}".strip())
        for name, value in values.items()
        if isinstance(value, float) and value and math.isfinite(value)
    ]


def source(results: Results) -> str:
    """The source of the hull data; empty where the scenario has no named vessel."""
    name = results.ship.scenario.vessel_sim.vessel.name
    return read_vessel(name).source.get("citation", "") if name else ""


def write(folder: Path, results: Results) -> dict[str, Path]:
    """Write the page, the metrics as CSV and a scenario for each manoeuvre, which the nodes can run, into an existing folder."""
    files = {"page": folder / "manoeuvres.html", "metrics": folder / "manoeuvres.csv", "scenarios": folder / "scenarios"}
    with writing(f"results in {folder}"):
        files["scenarios"].mkdir(exist_ok=True)
        for name, done in results.manoeuvres.items():
            (files["scenarios"] / f"{name}.yaml").write_text(dump_scenario(done.scenario), encoding="utf-8")
        write_csv(files["metrics"], results)
        files["page"].write_text(render(results, files["scenarios"]), encoding="utf-8")
    return files


def write_csv(path: Path, results: Results) -> None:
    """Write a row for each metric: manoeuvre, metric, value in SI units and degrees, unit, in lengths, limit of its criterion."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["manoeuvre", "metric", "value", "unit", "in_lengths", "limit", "complete"])
        for row in rows(results):
            limit = None if row.criterion is None else row.criterion.limit
            writer.writerow([*row[:5], limit, results.manoeuvres[row.manoeuvre].complete])


def render(results: Results, scenarios: Path) -> str:
    """Render the HTML text of the page."""
    lines = rows(results)
    about = [subtitle(results), *([f"Hull data: {published}"] if (published := source(results)) else []), EXPLANATION]
    about.append(f"Over the ROS nodes, with the same numbers: vessel-hsmc run {scenarios}/{next(iter(results.manoeuvres))}.yaml")
    sections = []
    if judged := [(TITLES[row.manoeuvre], *row.cells) for row in lines if row.criterion]:
        text = f"{SOURCE}: {APPLIES}. For a smaller ship they are for comparison only."
        sections.append(_section("Criteria", text, ["manoeuvre", *HEAD], judged, texts=2))
    for name, done in results.manoeuvres.items():
        of_one = [row.cells for row in lines if row.manoeuvre == name]
        drawn = [] if done.failure else [FIGURES[done.scenario.controller.manoeuvre.kind](done)]
        sections.append(_section(TITLES[name], " ".join(notes(done)), HEAD, of_one, figures=drawn))
    sections.append(Section("Hull data", head=["parameter", "value"], lines=hull_data(results)))
    return render_sections(f"Standard manoeuvres: {results.ship.name}", about, sections)


def _section(
    title: str, text: str, head: Sequence[str], lines: Sequence[Sequence[str]], texts: int = 1, figures: Sequence[Figure] = ()
) -> Section:
    """A section with the columns of a table that have a text in any line; the last one is words."""
    filled = [any(column) for column in zip(*lines, strict=True)]
    shown = [[*compress(line, filled)] for line in (head, *lines)]
    return Section(title, text, shown[0], shown[1:], texts, prose=filled[-1:] == [True], figures=figures)


def subtitle(results: Results) -> str:
    """The ship and its test speed in a line."""
    ship = results.ship
    limits = f"up to {quantity(ship.largest_force, 'N')} and {quantity(ship.largest_moment, 'N·m')}"
    speeds = f"test speed {quantity(ship.speed, 'm/s')} of {quantity(ship.top_speed, 'm/s')}"
    return f"{quantity(ship.length, 'm')} long · {limits} · {speeds} · still water, first turn to starboard"


SHIP, COMMAND, LIMIT = "--run-0", "--run-1", "--limit"

EXPLANATION = (
    "The ship is commanded by a surge force and a yaw moment: a rudder angle of 35° stands for the whole yaw moment, smaller"
    " angles for a proportional part. Times and distances count from the execute, at the end of the approach."
)


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
    return {"title": "Track", "traces": traces, "layout": drawn}


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
    return {"title": "Heading and rudder", "traces": traces, "layout": drawn}


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
    drawn = layout(Axis("rudder angle [°]"), Axis("steady yaw rate [°/s]"), 380, legend=True)
    return {"title": "Steady turns", "traces": traces, "layout": drawn}


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
    return {"title": "Speed along the path", "traces": traces, "layout": drawn}


def speed_run(done: Manoeuvre) -> Figure:
    """Surge force over steady speed."""
    curve = speed_curve(done.track, done.scenario.controller.manoeuvre)
    force = done.scenario.controller.vessel.surge_force_limit
    factor, unit = scaled(force, "N")
    speed, pull = np.concatenate(([0.0], curve[:, 1])), np.concatenate(([0.0], factor * force * curve[:, 0]))
    drawn = layout(Axis("steady speed [m/s]"), Axis(f"surge force [{unit}]"), 380)
    return {"title": "Force and speed", "traces": [line(speed, pull, "surge force", SHIP, "lines+markers")], "layout": drawn}


def bollard_pull(done: Manoeuvre) -> Figure:
    """The applied force over time."""
    track = done.track
    factor, unit = scaled(float(track.force[-1]), "N")
    drawn = layout(Axis("time [s]"), Axis(f"surge force [{unit}]"), 380)
    drawn["yaxis"] |= {"rangemode": "tozero"}
    force = line(track.time, factor * track.force, "applied force", SHIP)
    return {"title": "Applied force", "traces": [force], "layout": drawn}


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
