"""The page of a campaign: a single HTML file without external resources."""

import json
from importlib import resources
from pathlib import Path

import jinja2

from vessel_hsmc_ros.campaign import findings, ship_findings
from vessel_hsmc_ros.campaign.diagrams import Diagrams
from vessel_hsmc_ros.campaign.page_figures import colour, figures
from vessel_hsmc_ros.campaign.results import Results
from vessel_hsmc_ros.campaign.sensitivity import FEWEST, Influence
from vessel_hsmc_ros.campaign.statistics import CONFIDENCE
from vessel_hsmc_ros.report.page import asset, library, origin
from vessel_hsmc_ros.report.style import css_variables

SCRIPTS = ("data.js", "theme.js", "diagram.js")
"""Scripts that this page shares with others."""


def render(results: Results, found: dict[str, list[Influence]], drawn: Diagrams, folder: Path) -> str:
    """Render the HTML text of the page.

    Args:
        results: All runs.
        found: The influences on the main metric for each law.
        drawn: The diagrams.
        folder: The folder of the campaign, for the commands.
    """
    campaign, laws = results.campaign, list(results.by_variant)
    shown = figures(drawn, laws)
    content = {"figures": shown, "command": findings.replay_command(folder, 0).rpartition(" ")[0]}
    return _template().render(
        title=f"Campaign {campaign.name}",
        subtitle=_subtitle(results),
        origin=origin(),
        sentences=findings.sentences(results, found),
        notes=_notes(results),
        colours={law: colour(law, laws) for law in laws},
        lost=ship_findings.lost(ship_findings.ships_of(results)) if campaign.has_ships else None,
        failures=findings.failures(results),
        quantiles=findings.quantiles(results),
        comparisons=findings.comparisons(results),
        causes=findings.causes(found),
        worst=findings.worst(results, folder),
        folder=folder,
        file=campaign.source.text.strip(),
        figures=shown,
        fewest=FEWEST,
        independent=campaign.independent,
        confidence=f"{100.0 * CONFIDENCE:g} %",
        style=css_variables() + asset("style.css"),
        script="\n".join([*map(asset, SCRIPTS), _own("campaign.js")]),
        # "<" escaped: a name that contains "</script>" would end the script element.
        content=json.dumps(content, separators=(",", ":")).replace("<", "\\u003c"),
        library=library(),
    )


def _own(name: str) -> str:
    return resources.files("vessel_hsmc_ros.campaign").joinpath("assets", name).read_text(encoding="utf-8")


def _template() -> jinja2.Template:
    # StrictUndefined: a misspelt name in the template is an error instead of an empty text.
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.from_string(_own("campaign.html"))


def _subtitle(results: Results) -> str:
    """What was run, in a line."""
    campaign = results.campaign
    count = f"{campaign.runs} runs" if len(results) == campaign.runs else f"{len(results)} of {campaign.runs} runs so far"
    several = f" × {len(campaign.variants)} {campaign.variant_column}s" if len(campaign.variants) > 1 else ""
    draws = f"{campaign.draws} draws{several}"
    duration = "" if campaign.has_ships else f", {campaign.base.vessel_sim.duration:g} s"
    scenario = f"scenario {campaign.source.scenario_name}{duration}"
    return f"{count} ({draws}) · {scenario} · {', '.join(campaign.variants)} · {campaign.sampling}, seed {campaign.seed}"


def _notes(results: Results) -> list[str]:
    """What the reader must know to judge the numbers."""
    found = []
    if not results.campaign.independent and not results.campaign.grids:
        name = results.campaign.sampling.replace("_", " ")
        found.append(f"Confidence intervals take independent draws. Those of a {name} are spread evenly, so there are none here.")
    if not (results.campaign.limits or results.campaign.limits_in_lengths):
        found.append("The campaign has no limits, so only runs that ended early are failures.")
    return found
