"""The page of a tuning: what it has gained, the front of trade-offs, the gains, every case before and after."""

import base64
import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment

from vessel_hsmc_ros.runs.sweep_figure import label, text
from vessel_hsmc_ros.scenario.run_folder import provenance
from vessel_hsmc_ros.tuning.cases import Case
from vessel_hsmc_ros.tuning.gains import NODE
from vessel_hsmc_ros.tuning.plan import Evaluation
from vessel_hsmc_ros.tuning.result import Result, verdict

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{{ title }}</title>
<style>
:root { color-scheme: light dark }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 1100px; padding: 0 1rem }
img { max-width: 100%; background: #fff; border-radius: 6px } .table { overflow-x: auto } table { border-collapse: collapse }
th, td { padding: .2rem .8rem; text-align: right; border-bottom: 1px solid #8884; white-space: nowrap }
th:first-child, td:first-child { text-align: left } .marked { font-weight: 600 } code { font-size: 13px }
</style>
<h1>{{ title }}</h1>
<p>{% for line in verdict %}{{ line }} {% endfor %}</p>
<p>{{ about }}</p>
{% for section in sections %}<h2>{{ section.title }}</h2>
{% if section.text %}<p>{{ section.text }}</p>{% endif %}
{% if section.picture %}<img alt="{{ section.title }}" src="data:image/png;base64,{{ section.picture }}">{% endif %}
{% if section.lines %}<div class="table"><table><tr>{% for name in section.head %}<th>{{ name }}</th>{% endfor %}</tr>
{% for line in section.lines %}<tr{% if line[0] in section.marked %} class="marked"{% endif %}>
{%- for cell in line %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</table></div>{% endif %}
{% endfor %}</html>
"""

FEW = 60
"""Largest number of cases, and of trials of the front, that have a row of their own."""

Section = dict[str, object]
Lines = list[list[str]]


def render(result: Result, pictures: Sequence[Path]) -> str:
    """The page, with everything in it.

    Args:
        result: The result.
        pictures: Those of the front and of the search.
    """
    front, search = (base64.b64encode(path.read_bytes()).decode() for path in pictures)
    tuning = result.tuning
    metric = label(tuning.objective.metric)
    sections: list[Section] = [
        {"title": "Gains", "head": GAINS_HEAD, "lines": gains_table(result)},
        {"title": "Cost against effort", "picture": front, "text": FRONT_TEXT},
        {"title": "Front of trade-offs", **_front_table(result)},
        {"title": "The search", "picture": search, "text": _pruned(result)},
        {"title": f"Cases: {metric}", **_case_table(result, tuning.cases, result.present, result.tuned)},
    ]
    if result.differs:
        table = _case_table(result, result.held_out, result.held_out_present, result.held_out_tuned)
        sections.append({"title": f"Held-out runs: {metric}", **table})
    return (
        Environment(autoescape=True)
        .from_string(PAGE)
        .render(title=f"Tuning of {tuning.law}", verdict=verdict(result), about=_about(result), sections=sections)
    )


GAINS_HEAD = ["gain", "present", "tuned", "range", ""]

FRONT_TEXT = (
    "A point is a trial. A trial on the front has no other below it and to its left: less error costs effort. Where the present"
    " gains lie on the front, only the trade-off can be changed; where they lie above it, tuning improves both."
)


def gains_table(result: Result) -> Lines:
    """A line for each gain: present and tuned value, range, and a note where the tuned one is at its edge."""
    return [
        [
            gain.parameter.removeprefix(NODE),
            f"{result.tuning.present[gain.parameter]:.4g} {gain.unit}".strip(),
            f"{result.best.gains[gain.parameter]:.4g} {gain.unit}".strip(),
            f"{gain.low:.3g} to {gain.high:.3g}",
            "at the edge" if result.at_edge(gain) else "",
        ]
        for gain in result.tuning.gains
    ]


def _about(result: Result) -> str:
    objective, trials = result.tuning.objective, result.trials
    return (
        f"{len(trials)} trials of {len(result.tuning.cases)} runs, offline, version {provenance()['version']}. The cost is the"
        f" {objective.aggregate.replace('_', ' ')} over the runs of {objective.metric}, divided by its limit or, without one, by"
        f" its value with the present gains; the effort is the same of {objective.second}."
    )


def _front_table(result: Result) -> Section:
    """The trials of the front with their gains; the chosen one is marked."""
    head = ["trial", "cost", "effort", *(gain.name for gain in result.tuning.gains)]
    lines = [
        [
            str(trial.number),
            f"{trial.cost.cost:.4g}",
            f"{trial.cost.effort:.4g}",
            *(f"{value:.4g}" for value in trial.gains.values()),
        ]
        for trial in result.front[:FEW]
        if trial.cost is not None
    ]
    return {"head": head, "lines": lines, "marked": [str(result.best.number)]}


def _pruned(result: Result) -> str:
    """How many trials were pruned, with their most frequent reason."""
    reasons = Counter(trial.reason for trial in result.trials if trial.cost is None)
    if not reasons:
        return ""
    first = next(trial.reason for trial in result.trials if trial.cost is None)
    return f"{reasons.total()} trials were pruned, because their gains are not allowed together; the first: {first}"


def _case_table(result: Result, cases: Sequence[Case], present: Evaluation, tuned: Evaluation) -> Section:
    """The metric of every case before and after, those with the largest ratio first if there are many."""
    metric = result.tuning.objective.metric
    ratios = tuned.values[:, 0] / present.values[:, 0]
    order = sorted(range(len(cases)), key=lambda i: -ratios[i] if math.isfinite(ratios[i]) else -math.inf)
    shown = range(len(cases)) if len(cases) <= FEW else order[:FEW]
    lines = [
        [
            cases[i].name,
            text(metric, cases[i].limits.get(metric, math.nan)),
            _cell(present, i, metric),
            _cell(tuned, i, metric),
            f"{ratios[i]:.3g}" if math.isfinite(ratios[i]) else "",
        ]
        for i in shown
    ]
    note = "" if len(cases) <= FEW else f"The {FEW} of {len(cases)} runs that have become worst."
    return {"head": ["case", "limit", "present gains", "tuned gains", "ratio"], "lines": lines, "text": note}


def _cell(evaluation: Evaluation, index: int, metric: str) -> str:
    return "failed" if evaluation.failures[index] else text(metric, float(evaluation.values[index, 0]))
