"""The report of a campaign: a page and its figures, from the rows that there are so far."""

from pathlib import Path

from vessel_hsmc_ros.campaign import figures, page
from vessel_hsmc_ros.campaign.diagrams import diagrams
from vessel_hsmc_ros.campaign.findings import influences_by_variant, sentences
from vessel_hsmc_ros.campaign.results import read
from vessel_hsmc_ros.core.exceptions import ReportError


def make_report(folder: Path, output: Path | None = None) -> tuple[list[str], dict[str, Path]]:
    """Write the report of a campaign, complete or not.

    Args:
        folder: The folder of the campaign.
        output: The page; by default `report.html` in the folder. The figures are in `figures/` beside it.

    Returns:
        The findings in words, and the paths by kind: page and figures.

    Raises:
        CampaignError: the folder is not that of a campaign, or a file of it is damaged.
        ReportError: the campaign has no results yet, or a file cannot be written.
    """
    results = read(folder)
    found = influences_by_variant(results)
    drawn = diagrams(results, found)
    path = output or folder / "report.html"
    try:
        path.write_text(page.render(results, found, drawn, folder), encoding="utf-8")
        pictures = figures.draw(path.parent / "figures", drawn)
    except OSError as error:
        raise ReportError(f"report {path} cannot be written: {error.strerror}") from None
    words = [f"{law}: {sentence}" if law else sentence for law, sentence in sentences(results, found)]
    return words, {"page": path, **pictures}
