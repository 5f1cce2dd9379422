"""What an identification has found: a page with pictures, a vessel file, and the steady load that explains a bad prediction.

    min over L of the sum over the windows of |p(L) - p_measured|², by Gauss-Newton steps from L = 0

p(L) are the predicted positions with a constant force in the earth frame beside the recorded wrench, or in a constant current.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.install_paths import __version__
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.report.diagrams import POINTS, Axis, Figure, layout, level, line, numbers
from vessel_hsmc_ros.report.page_kit import Section, render_sections
from vessel_hsmc_ros.scenario.parameters_file import tree
from vessel_hsmc_ros.studies.identification.types import Identified, Measurements, Prediction, predict

COMPONENTS = ("force_x", "force_y")

PROBE_SHARE = 0.01  # load by which the linearisation is made, as a share of the rms surge force or the rms speed of the run
ITERATIONS = 4  # largest number of Gauss-Newton steps: drag is not linear in the current
EXPLAINED = 0.5  # a load explains a run if it reduces the position error to this share or less


class SteadyLoad(NamedTuple):
    """A steady force or a steady current in the earth frame."""

    kind: str  # `force` or `current`
    # x, y: its components, N or m/s
    x: float
    y: float
    # before, after: rms position errors of the prediction without and with it, m
    before: float
    after: float

    @property
    def explains(self) -> bool:
        """Whether the prediction with it is much better."""
        return self.after <= EXPLAINED * self.before

    def sentence(self, run: str) -> str:
        """What the load means for a run, in words."""
        before, after = quantity(self.before, "m"), quantity(self.after, "m")
        if not self.explains:
            return f"{run}: no steady force or current explains the position error of {before} (the best leaves {after})"
        unit, remedy = ("N", ": look for wind that the other runs did not have") if self.kind == "force" else ("m/s", "")
        size = towards(self.x, self.y, unit)
        return f"{run}: a steady {self.kind} of {size} from x explains the position error of {before} ({after} with it){remedy}"


def towards(x: float, y: float, unit: str) -> str:
    """Size and direction of a horizontal vector, such as `0.3 m/s towards 90°`."""
    return f"{quantity(math.hypot(x, y), unit)} towards {round(math.degrees(math.atan2(y, x)))}°"


def steady_load(values: Mapping[str, float], run: Measurements, window: float, inputs: Mapping[str, float]) -> SteadyLoad:
    """Find the steady force or the steady current with which a run is predicted best, whichever predicts it better."""

    def pushed(x: float, y: float) -> Prediction:
        added = {name: inputs.get(name, 0.0) + more for name, more in zip(COMPONENTS, (x, y), strict=True)}
        return predict(values, run, window, {**inputs, **added})

    def drifting(x: float, y: float) -> Prediction:
        return predict(values, run, window, inputs, (x, y))

    plain = drifting(0.0, 0.0)
    speed = np.hypot(plain.measured[:, 3], plain.measured[:, 4])
    force, current = (
        _fitted(kind, predicted, PROBE_SHARE * float(np.sqrt(np.mean(np.square(size)))) or PROBE_SHARE, plain)
        for kind, predicted, size in (("force", pushed, run.wrench[:, 0]), ("current", drifting, speed))
    )
    return min(force, current, key=lambda load: load.after)


def _fitted(kind: str, predicted: Callable[[float, float], Prediction], probe: float, plain: Prediction) -> SteadyLoad:
    """The load of one kind that predicts best."""
    error = plain.rms()["position"]
    best, there = SteadyLoad(kind, 0.0, 0.0, error, error), plain
    for _ in range(ITERATIONS):
        base = _positions(there)
        probes = ((best.x + probe, best.y), (best.x, best.y + probe))
        slopes = np.column_stack([(_positions(predicted(*each)) - base) / probe for each in probes])
        residual = there.measured[:, :2].ravel() - base
        known = np.isfinite(residual) & np.isfinite(slopes).all(axis=1)
        x, y = np.linalg.lstsq(slopes[known], residual[known], rcond=None)[0].tolist()
        there = predicted(best.x + x, best.y + y)
        if not (after := there.rms()["position"]) < best.after:
            break
        best = SteadyLoad(kind, best.x + x, best.y + y, error, after)
    return best


def _positions(prediction: Prediction) -> Array:
    """Predicted x and y in one column; NaN outside the windows."""
    return prediction.simulated[:, :2].ravel()


ERRORS_TITLE = "Prediction errors, rms over windows"
ERRORS_HEAD = ["run", "position", "heading", "surge velocity", "sway velocity", "yaw rate"]
CITATION = "identified from recorded motion by vessel_hsmc_ros"
PARAMETERS_HEAD = ["parameter", "estimate", "standard error", "relative", "unit", "meaning"]


class HeldOut(NamedTuple):
    """A run that the identification has not used."""

    run: Measurements
    prediction: Prediction  # with the identified parameters
    before: Prediction | None  # with the start vessel; None without one
    load: SteadyLoad  # the steady force or current that fits the run best


UNUSUAL = 2.0
"""Ratio of the position error of a held-out run to the largest of the runs used above which its cause is looked for."""


def explanations(found: Identified, held_out: Sequence[HeldOut]) -> list[str]:
    """A sentence on each held-out run that is predicted much worse than the runs used: what would explain it."""
    usual = max(prediction.rms()["position"] for prediction in found.predictions)
    return [each.load.sentence(each.run.name) for each in held_out if each.load.before > UNUSUAL * usual]


def render(name: str, runs: Sequence[Measurements], found: Identified, held_out: Sequence[HeldOut]) -> str:
    """The page, with everything in it."""
    sections = [
        Section(ERRORS_TITLE, WINDOWS_TEXT, head=ERRORS_HEAD, lines=errors_table(runs, found, held_out)),
        Section("Parameters", head=PARAMETERS_HEAD, lines=parameters_table(found), prose=True),
    ]
    if found.unidentifiable:
        sections.append(Section("Held parameters", head=["parameter", "why"], lines=found.unidentifiable, prose=True))
    sections += [Section(f"Held out: {each.run.name}", figures=prediction_figures(each.prediction)) for each in held_out]
    for run, prediction in zip(runs, found.predictions, strict=True):
        sections.append(Section(f"Used: {run.name}", figures=prediction_figures(prediction)))
    sections += [
        Section("Residuals", RESIDUALS_TEXT, figures=residual_figures([run.time for run in runs], found)),
        Section("Correlations", CORRELATIONS_TEXT, figures=[correlation_figure(found)]),
    ]
    findings = [*found.warnings, *explanations(found, held_out)]
    return render_sections(f"Identification of {name}", [_about(runs, found)], sections, findings)


WINDOWS_TEXT = (
    "Each window is simulated from the measured state at its start with the recorded wrench. Only errors on held-out runs show"
    " how well the ship will be predicted."
)
RESIDUALS_TEXT = (
    "Measured minus simulated motion, with twice its standard deviation dashed. What is left should be noise: a pattern is a"
    " force that the model does not have, such as wind."
)
CORRELATIONS_TEXT = (
    "Two parameters with a correlation near 1 or -1 cannot be distinguished by these runs: only their combination is known. Other"
    " manoeuvres separate them; vessel-hsmc excite writes some."
)


def errors_table(runs: Sequence[Measurements], found: Identified, held_out: Sequence[HeldOut]) -> list[list[str]]:
    """Prediction errors, a line for each run; for held-out runs a second one with the start vessel."""
    lines = [[f"used: {run.name}", *errors(prediction).values()] for run, prediction in zip(runs, found.predictions, strict=True)]
    for each in held_out:
        lines.append([f"held out: {each.run.name}", *errors(each.prediction).values()])
        if each.before is not None:
            lines.append([f"held out, start vessel: {each.run.name}", *errors(each.before).values()])
    return lines


def errors(prediction: Prediction) -> dict[str, str]:
    """Root mean square errors over all windows, with their units."""
    rms = prediction.rms()
    degrees = math.degrees(1.0)
    return {
        "position": f"{rms['position']:.3g} m",
        "heading": f"{degrees * rms['heading']:.3g}°",
        "surge": f"{rms['surge']:.3g} m/s",
        "sway": f"{rms['sway']:.3g} m/s",
        "yaw_rate": f"{degrees * rms['yaw_rate']:.3g}°/s",
    }


def parameters_table(found: Identified) -> list[list[str]]:
    """Estimates with their standard errors, and the current of each run."""
    entries = schema.entries(VesselParameters)
    lines = []
    for name, value in found.parameters.items():
        error, entry = found.standard_errors[name], entries.get(name)
        relative = f"{100.0 * error / abs(value):.2g} %" if value else ""
        described = (entry.unit, entry.description) if entry else ("", "Input gain or offset.")
        lines.append([name, f"{value:.4g}", f"{error:.2g}", relative, *described])
    meaning = ("m/s", "Steady current over ground; its direction is measured from x towards y.")
    for number, (x, y, error) in enumerate(found.currents, 1):
        speed = math.hypot(x, y)
        estimate = [towards(x, y, "m/s"), f"{error:.2g}", f"{100.0 * error / speed:.2g} %"] if speed else ["none found", "", ""]
        lines.append([f"current of run {number}", *estimate, *meaning])
    return lines


def _about(runs: Sequence[Measurements], found: Identified) -> str:
    """What was identified from what."""
    samples, minutes = sum(len(run.time) for run in runs), sum(float(run.time[-1] - run.time[0]) for run in runs) / 60.0
    count = f"{len(runs)} {'run' if len(runs) == 1 else 'runs'}, {samples} samples, {minutes:.1f} min"
    return f"Model {found.model.name}, {len(found.standard_errors)} parameters from {count}."


COLUMNS = (("surge velocity", "m/s", 1.0), ("sway velocity", "m/s", 1.0), ("yaw rate", "°/s", 180.0 / np.pi))
STATES = (("x", "m", 1.0), ("y", "m", 1.0), ("heading", "°", 180.0 / np.pi), *COLUMNS)

MEASURED, SIMULATED = "--shared", "--run-0"


def prediction_figures(prediction: Prediction) -> list[Figure]:
    """Track and velocities, measured and simulated window by window."""
    keep = slice(None, None, max(len(prediction.time) // POINTS, 1))
    time, measured, simulated = (values[keep] for values in (prediction.time, prediction.measured, prediction.simulated))
    broken = _broken(time, simulated, prediction.starts)

    def drawn(x: Axis, y: Axis, *lines: tuple[Array, Array]) -> Figure:
        looks = (("measured", MEASURED, 4.0), ("simulated", SIMULATED, 1.6))
        traces = [line(*values, name, colour, width=width) for values, (name, colour, width) in zip(lines, looks, strict=True)]
        return {"title": y.name, "traces": traces, "layout": layout(x, y, legend=True)}

    track = drawn(Axis("x [m]"), Axis("y [m]"), (measured[:, 0], measured[:, 1]), (broken[:, 0], broken[:, 1]))
    track["layout"]["yaxis"] |= {"scaleanchor": "x"}
    velocities = [
        drawn(Axis("time [s]"), Axis(f"{name} [{unit}]"), (time, factor * measured[:, i]), (time, factor * broken[:, i]))
        for i, (name, unit, factor) in enumerate(COLUMNS, 3)
    ]
    return [{**track, "title": "Track"}, *velocities]


def _broken(time: Array, simulated: Array, starts: Array) -> Array:
    """The simulated motion with a gap at the start of each window, where it begins at the measured state again."""
    gaps = simulated.copy()
    gaps[np.clip(np.searchsorted(time, starts), 0, len(time) - 1)] = np.nan
    return gaps


def residual_figures(times: Sequence[Array], found: Identified) -> list[Figure]:
    """Residuals of all measured states over time, one run after the other, with twice their standard deviation.

    `times`: time of each run, (n,), s.
    """
    begins = np.cumsum([0.0, *(time[-1] - time[0] for time in times)])
    along = np.concatenate([begin + time - time[0] for begin, time in zip(begins, times, strict=False)])
    figures = []
    for i, (name, unit, factor) in enumerate(STATES):
        residual = factor * np.concatenate([each[:, i] for each in found.residuals])
        drawn = layout(Axis("time [s]"), Axis(f"{name} [{unit}]"))
        drawn["shapes"] = [level(side * factor * found.noise[i], "--run-1") for side in (-2.0, 2.0)]
        figures.append({"title": name, "traces": [line(along, residual, name, SIMULATED, width=1.0)], "layout": drawn})
    return figures


def correlation_figure(found: Identified) -> Figure:
    """The correlations of the estimates."""
    names = list(found.standard_errors)
    hover = "%{y}<br>%{x}<br>%{z:.2f}<extra></extra>"
    colours = {"colorscale": "RdBu", "zmin": -1.0, "zmax": 1.0, "colorbar": {"thickness": 12, "outlinewidth": 0}}
    cells = [numbers(row) for row in found.correlation]
    trace = {"type": "heatmap", "x": names, "y": names, "z": cells, "hovertemplate": hover, **colours}
    drawn = layout(Axis(""), Axis(""), 130 + 24 * len(names))
    drawn["xaxis"] |= {"automargin": True}
    drawn["yaxis"] |= {"automargin": True, "autorange": "reversed"}
    return {"title": "Correlations of the estimates", "traces": [trace], "layout": drawn}


LIMITS = {"surge_force_limit": 0, "yaw_moment_limit": 2}  # limits of the propulsion with their columns of the wrench
PREFIX = "vessel."


def vessel_text(
    name: str, found: Identified, runs: Sequence[Measurements], known: Mapping[str, object], errors: Mapping[str, str]
) -> str:
    """Write a vessel file in the format of the library."""
    check_known(known)
    largest = {key: float(np.nanmax(np.abs(np.concatenate([run.wrench[:, i] for run in runs])))) for key, i in LIMITS.items()}
    hull = {key: _digits(value) for key, value in found.vessel_values().items()}
    document = {
        "name": name,
        "description": f"Identified from {', '.join(run.name for run in runs)}.",
        "source": {
            "citation": f"{CITATION} {__version__}, model {found.model.name}",
            "table": ", ".join(run.name for run in runs),
        },
        "checks": {
            "verified": [f"{key} on held-out data: {value}" for key, value in errors.items()],
            "unverified": [f"{key} is held: {why}" for key, why in found.unidentifiable],
        },
        "vessel": {**{key: _digits(value) for key, value in largest.items() if value > 0.0}, **known, **hull},
    }
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=120, default_flow_style=None)


def check_known(known: Mapping[str, object]) -> None:
    """Check that what is known of a ship suffices for a vessel file. Raises ParameterError if length or beam is not known."""
    for needed in ("length", "beam"):
        if needed not in known:
            raise ParameterError(f"the {needed} of the ship is not known: give --vessel START, or --{needed}")


def is_identified(path: Path) -> bool:
    """Whether a file is a vessel that `vessel_text` has written."""
    return CITATION in path.read_text(encoding="utf-8", errors="replace")


def known_of(values: Mapping[str, object], estimated: Mapping[str, float]) -> dict[str, object]:
    """What a start vessel states beyond the estimates, nested as in a vessel file."""
    replaced = {*estimated, "surge_speed_range", "sway_speed_range", "yaw_rate_range", "name"}
    own = {name.removeprefix(PREFIX): value for name, value in values.items() if name.startswith(PREFIX)}
    return tree({name: value for name, value in own.items() if name not in replaced})


def _digits(value: float | list[float]) -> float | list[float]:
    """Numbers with six digits."""
    return [float(f"{each:.6g}") for each in value] if isinstance(value, list) else float(f"{value:.6g}")
