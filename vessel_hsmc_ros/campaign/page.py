"""The page of a campaign: a single HTML file without external resources."""

from pathlib import Path

from vessel_hsmc_ros.campaign import findings, ship_findings
from vessel_hsmc_ros.campaign.diagrams import Diagrams
from vessel_hsmc_ros.campaign.page_figures import colour, figures
from vessel_hsmc_ros.campaign.results import Results
from vessel_hsmc_ros.campaign.sensitivity import FEWEST, Influence
from vessel_hsmc_ros.campaign.statistics import CONFIDENCE
from vessel_hsmc_ros.report import page_kit


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
    return page_kit.render(
        "campaign/campaign.html",
        f"Campaign {campaign.name}",
        [_subtitle(results)],
        scripts=(*page_kit.DIAGRAM_SCRIPTS, "campaign/campaign.js"),
        content=content,
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
    )


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
        found.append(
            f"No confidence intervals are stated: they are valid for independent draws only, and those of a {name} are not."
        )
    if not (results.campaign.limits or results.campaign.limits_in_lengths):
        found.append("The campaign has no limits, so only runs that ended early are failures.")
    return found
