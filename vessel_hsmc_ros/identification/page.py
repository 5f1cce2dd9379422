"""The page of an identification: measured against simulated, on data used and held out; parameters, residuals, correlations."""

import base64
import math
from collections.abc import Sequence
from typing import NamedTuple

from jinja2 import Environment, StrictUndefined

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.identification.figures import correlation_picture, prediction_picture, residuals_picture
from vessel_hsmc_ros.identification.steady_force import SteadyForce
from vessel_hsmc_ros.identification.types import Identified, Measurements, Prediction
from vessel_hsmc_ros.plant.dynamics import VesselParameters
from vessel_hsmc_ros.report.page import origin

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{{ title }}</title><link rel="icon" href="data:,">
<style>
:root { color-scheme: light dark }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 1100px; padding: 0 1rem }
img { max-width: 100%; background: #fff; border-radius: 6px } .table { overflow-x: auto } table { border-collapse: collapse }
th, td { padding: .2rem .8rem; text-align: right; border-bottom: 1px solid #8884; white-space: nowrap }
th:first-child, td:first-child { text-align: left } .texts :is(td, th):last-child { text-align: left; white-space: normal }
.soft { color: #808890 } .warning { border-left: 4px solid #d55e00; padding-left: .8rem }
td:first-child { font: 13px ui-monospace, monospace }
</style>
<h1>{{ title }}</h1>
<p>{{ about }}</p>
<p class="soft">{{ origin }}</p>
{% for line in warnings %}<p class="warning">{{ line }}</p>{% endfor %}
{% for section in sections %}<h2>{{ section.title }}</h2>
{% if section.text %}<p>{{ section.text }}</p>{% endif %}
{% if section.picture %}<img alt="{{ section.title }}" src="data:image/png;base64,{{ section.picture }}">{% endif %}
{% if section.lines %}<div class="table{% if section.texts %} texts{% endif %}"><table>
<tr>{% for name in section.head %}<th>{{ name }}</th>{% endfor %}</tr>
{% for line in section.lines %}<tr>{% for cell in line %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</table></div>{% endif %}
{% endfor %}</html>
"""

ERRORS_TITLE = "Prediction errors, rms over windows"
ERRORS_HEAD = ["run", "position", "heading", "surge velocity", "sway velocity", "yaw rate"]
PARAMETERS_HEAD = ["parameter", "estimate", "standard error", "relative", "unit", "meaning"]


class HeldOut(NamedTuple):
    """A run that the identification has not used.

    Attributes:
        run: The run.
        prediction: With the identified parameters.
        before: With the start vessel; None without one.
        force: The steady force that fits the run best.
    """

    run: Measurements
    prediction: Prediction
    before: Prediction | None
    force: SteadyForce


UNUSUAL = 2.0
"""Ratio of the position error of a held-out run to the largest of the runs used above which its cause is looked for."""


def explanations(found: Identified, held_out: Sequence[HeldOut]) -> list[str]:
    """A sentence on each held-out run that is predicted much worse than the runs used: what would explain it."""
    usual = max(prediction.rms()["position"] for prediction in found.predictions)
    return [each.force.sentence(each.run.name) for each in held_out if each.force.before > UNUSUAL * usual]


def render(name: str, runs: Sequence[Measurements], found: Identified, held_out: Sequence[HeldOut]) -> str:
    """The page, with everything in it.

    Args:
        name: Name of the vessel.
        runs: The runs that the identification has used.
        found: The identification.
        held_out: Runs that it has not used.
    """
    sections: list[dict[str, object]] = [
        {"title": ERRORS_TITLE, "text": WINDOWS_TEXT, "head": ERRORS_HEAD, "lines": errors_table(runs, found, held_out)},
        {"title": "Parameters", "head": PARAMETERS_HEAD, "lines": parameters_table(found), "texts": True},
    ]
    if found.unidentifiable:
        lines = [list(row) for row in found.unidentifiable]
        sections.append({"title": "Held parameters", "head": ["parameter", "why"], "lines": lines, "texts": True})
    for each in held_out:
        sections.append({"title": f"Held out: {each.run.name}", "picture": _encoded(prediction_picture(each.prediction))})
    for run, prediction in zip(runs, found.predictions, strict=True):
        sections.append({"title": f"Used: {run.name}", "picture": _encoded(prediction_picture(prediction))})
    times = [run.time for run in runs]
    sections += [
        {"title": "Residuals", "text": RESIDUALS_TEXT, "picture": _encoded(residuals_picture(times, found))},
        {"title": "Correlations", "text": CORRELATIONS_TEXT, "picture": _encoded(correlation_picture(found))},
    ]
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    # Sections have different parts, so a missing one is empty.
    keys = ("text", "picture", "lines", "head", "texts")
    filled = [{**dict.fromkeys(keys, ""), **section} for section in sections]
    return environment.from_string(PAGE).render(
        title=f"Identification of {name}",
        about=_about(runs, found),
        origin=origin(),
        warnings=[*found.warnings, *explanations(found, held_out)],
        sections=filled,
    )


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
    """Estimates with their standard errors."""
    entries = schema.entries(VesselParameters)
    lines = []
    for name, value in found.parameters.items():
        error, entry = found.standard_errors[name], entries.get(name)
        relative = f"{100.0 * error / abs(value):.2g} %" if value else ""
        described = (entry.unit, entry.description) if entry else ("", "Input gain or offset.")
        lines.append([name, f"{value:.4g}", f"{error:.2g}", relative, *described])
    return lines


def _about(runs: Sequence[Measurements], found: Identified) -> str:
    """What was identified from what."""
    samples, minutes = sum(len(run.time) for run in runs), sum(float(run.time[-1] - run.time[0]) for run in runs) / 60.0
    count = f"{len(runs)} {'run' if len(runs) == 1 else 'runs'}, {samples} samples, {minutes:.1f} min"
    return f"Model {found.model.name}, {len(found.standard_errors)} parameters from {count}."


def _encoded(picture: bytes) -> str:
    return base64.b64encode(picture).decode()
