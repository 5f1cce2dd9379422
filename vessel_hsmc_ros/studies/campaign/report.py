"""The report of a campaign: a page without external resources and its figures, from the rows that there are so far."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.report import page_kit
from vessel_hsmc_ros.report.diagrams import Figure, draw
from vessel_hsmc_ros.studies.campaign import findings, ship_findings
from vessel_hsmc_ros.studies.campaign.diagrams import colour, diagrams
from vessel_hsmc_ros.studies.campaign.findings import influences_by_variant, sentences
from vessel_hsmc_ros.studies.campaign.results import Results, read
from vessel_hsmc_ros.studies.campaign.statistics import CONFIDENCE, FEWEST, Influence

PICTURES = {"exceedance": "distributions", "bars": "parameters", "scatter": "scatter", "map": "map"}
"""The kinds of the pictures, by the sections of the page whose diagrams they show."""


def make_report(folder: Path, output: Path | None = None) -> tuple[list[str], dict[str, Path]]:
    """Write the report of a campaign, complete or not.

    `output`: the page; by default `report.html` in the folder. The figures are in `figures/` beside it. Returns the findings in
    words, and the paths by kind: page and figures. Raises CampaignError if the folder is not that of a campaign, or a file of
    it is damaged; ReportError if the campaign has no results yet, or a file cannot be written.
    """
    results = read(folder)
    found = influences_by_variant(results)
    drawn = diagrams(results, found)
    path = output or folder / "report.html"
    try:
        path.write_text(render(results, found, drawn, folder), encoding="utf-8")
        figures = path.parent / "figures"
        figures.mkdir(exist_ok=True)
        pictures = {PICTURES[kind]: draw(figures / f"{PICTURES[kind]}.png", each) for kind, each in drawn.items() if each}
    except OSError as error:
        raise ReportError(f"report {path} cannot be written: {error.strerror}") from None
    words = [f"{law}: {sentence}" if law else sentence for law, sentence in sentences(results, found)]
    return words, {"page": path, **pictures}


def render(results: Results, found: dict[str, list[Influence]], drawn: Mapping[str, Sequence[Figure]], folder: Path) -> str:
    """Render the HTML text of the page.

    `found`: the influences on the main metric for each law. `drawn`: its diagrams, by section.
    """
    campaign = results.campaign
    content = {"figures": drawn, "command": findings.replay_command(folder, 0).rpartition(" ")[0]}
    return page_kit.render(
        "studies/campaign/campaign.html",
        f"Campaign {campaign.name}",
        [_subtitle(results)],
        scripts=(*page_kit.DIAGRAM_SCRIPTS, "studies/campaign/campaign.js"),
        content=content,
        sentences=findings.sentences(results, found),
        notes=_notes(results),
        colours={law: colour(results, law) for law in results.by_variant},
        lost=ship_findings.lost(ship_findings.ships_of(results)) if campaign.has_ships else None,
        failures=findings.failures(results),
        quantiles=findings.quantiles(results),
        comparisons=findings.comparisons(results),
        causes=findings.causes(found),
        worst=findings.worst(results, folder),
        folder=folder,
        file=campaign.source.text.strip(),
        figures=drawn,
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
        found.append(f"Draws by {name} are not independent, so no confidence intervals are stated.")
    if not (results.campaign.limits or results.campaign.limits_in_lengths):
        found.append("The campaign has no limits, so only runs that ended early are failures.")
    return found
