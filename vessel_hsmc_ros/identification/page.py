"""The page of an identification: measured against simulated, on data used and held out; parameters, residuals, correlations."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.identification.figures import correlation_picture, prediction_picture, residuals_picture
from vessel_hsmc_ros.identification.steady_force import SteadyForce
from vessel_hsmc_ros.identification.types import Identified, Measurements, Prediction
from vessel_hsmc_ros.plant.dynamics import VesselParameters
from vessel_hsmc_ros.report.page_kit import Section, render_sections

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
    sections = [
        Section(ERRORS_TITLE, WINDOWS_TEXT, head=ERRORS_HEAD, lines=errors_table(runs, found, held_out)),
        Section("Parameters", head=PARAMETERS_HEAD, lines=parameters_table(found), prose=True),
    ]
    if found.unidentifiable:
        sections.append(Section("Held parameters", head=["parameter", "why"], lines=found.unidentifiable, prose=True))
    sections += [Section(f"Held out: {each.run.name}", picture=prediction_picture(each.prediction)) for each in held_out]
    for run, prediction in zip(runs, found.predictions, strict=True):
        sections.append(Section(f"Used: {run.name}", picture=prediction_picture(prediction)))
    sections += [
        Section("Residuals", RESIDUALS_TEXT, residuals_picture([run.time for run in runs], found)),
        Section("Correlations", CORRELATIONS_TEXT, correlation_picture(found)),
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
