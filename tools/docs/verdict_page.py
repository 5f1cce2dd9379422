"""The generated parts of docs/verdict.md; `python tools/docs/verdict_page.py docs` writes them."""

import re
import sys
from pathlib import Path

from vessel_hsmc_ros.studies.paper.cases import LAWS, PRINTED, REPAIRED, Numbers, Results, claims_that_hold, of_law
from vessel_hsmc_ros.studies.paper.reproduction import load

BLOCK = re.compile(r"(<!-- generated: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)

CASE_TITLES = {
    "circle": "circle, the paper's case 2",
    "straight": "straight line",
    "slalom_long": "slalom, 800 s",
    "stabilisation": "station keeping, the paper's case 3",
    "stabilisation_calm": "station keeping in calm water",
    "circle_weak_hull": "circle, damping × 0.5",
    "circle_stiff_hull": "circle, damping × 1.5",
}


def with_results(page: str, results: Results) -> str:
    """The page with the parts that follow from the results; other generated parts stay."""
    parts = {"claims": _claims(results), "cases": _cases(results), "networks": _networks(results), "bounds": _bounds(results)}
    return BLOCK.sub(lambda match: f"{match[1]}{parts[match[2]]}\n{match[3]}" if match[2] in parts else match[0], page)


def _claims(results: Results) -> str:
    return "\n".join(f"- {claims_that_hold(law, results)}." for law in LAWS)


def _cases(results: Results) -> str:
    head = [f"{words}: {what}" for words in LAWS.values() for what in ("position", "heading")]
    lines = [f"| rms over the last quarter | {' | '.join(head)} |", "|---|---|---|---|---|"]
    for run, words in CASE_TITLES.items():
        cells = [cell for law in LAWS for cell in _errors(of_law(law, results)[run])]
        lines.append(f"| {words} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _errors(numbers: Numbers) -> tuple[str, str]:
    position, heading = numbers.position_error_late, numbers.heading_error_late_deg
    length = (
        f"{position:.2g} m" if 0.02 <= position < 100.0 else f"{1e3 * position:.2g} mm" if position < 1.0 else f"{position:.0f} m"
    )
    return length, f"{heading:.0f}°" if heading >= 10.0 else f"{heading:.2g}°"


def _networks(results: Results) -> str:
    def errors(law: str) -> str:
        circle = of_law(law, results)["circle"]
        found = circle.surge_estimate_error, circle.sway_estimate_error, circle.yaw_estimate_error
        return "{:.2g}, {:.2g} and {:.2g}".format(*found)

    without = of_law(REPAIRED, results)["circle_no_learning"].position_error_late
    return (
        f"Without networks the error on the circle is {without:.2g} m. With them the errors of the estimates relative to"
        f" f_u, f_v and f_r are {errors(REPAIRED)}; as printed they are {errors(PRINTED)}."
    )


def _bounds(results: Results) -> str:
    circle = of_law(REPAIRED, results)["circle"]
    yaw, surge = (
        circle.yaw_switching_gain / circle.yaw_switching_gain_needed,
        circle.surge_switching_gain / circle.surge_switching_gain_needed,
    )
    return f"On the circle the switching gains eta1 and eta2 are {yaw:.2g} and {surge:.2g} times the bounds of (34)."


def main(folder: Path) -> None:
    """Write the parts into the page of a folder, from its results."""
    page = folder / "verdict.md"
    page.write_text(with_results(page.read_text(encoding="utf-8"), load(folder / "results.json")), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
