"""The pages about the paper agree with the stored results, and the stored results with the code."""

import dataclasses
import math
import re
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from verdict_page import with_results

from vessel_hsmc_ros.studies import batch
from vessel_hsmc_ros.studies.paper import reproduction
from vessel_hsmc_ros.studies.paper.cases import (
    CASES,
    CLAIMS,
    PREFIX,
    PRINTED,
    REPAIRED,
    Numbers,
    claims_page,
    of_law,
)

DOCS = Path(__file__).parents[3] / "docs"
PAGES = {name: (DOCS / f"{name}.md").read_text(encoding="utf-8") for name in ("verdict", "printed_law")}
VERDICT, PRINTED_LAW = (re.sub(r"\s+", " ", text) for text in PAGES.values())
RESULTS = reproduction.load(DOCS / "results.json")
CHEAP = ("circle_60", "circle_50_hz", "straight_a_1", "repaired_circle_60")
FINAL, LATE, STEP = "position_error_final", "heading_error_late_deg", "yaw_moment_step"
SECOND, NEAR = "heading_error_second_half_deg", "position_error_late"
AXES = ("surge", "sway", "yaw")

QUOTES = [
    ("circle, the paper's case 2 | {:.1f} m | {:.3f}°", ("circle", FINAL), ("circle", LATE)),
    ("straight line | {:.2f} m | {:.4f}°", ("straight", FINAL), ("straight", LATE)),
    ("slalom | {:.3f} m; {:.1f} m after 800 s | {:.4f}°", ("slalom", FINAL), ("slalom_long", FINAL), ("slalom", LATE)),
    ("case 3 | {:.2f} m | {:.4f}°", ("stabilisation", FINAL), ("stabilisation", LATE)),
    ("stabilisation, calm | {:.4f} m | {:.6f}°", ("stabilisation_calm", FINAL), ("stabilisation_calm", LATE)),
    ("case 1 | - | {:.4f}°", ("course", LATE)),
    ("after {:.1f} s, PD after {:.1f} s", ("course", "heading_settling_time"), ("course_pd", "heading_settling_time")),
    ("off by {:.4f}° and {:.1f}° rms", ("course_disturbed", SECOND), ("course_pd_disturbed", SECOND)),
    (
        "PD settles after {:.1f} s, earlier than sliding mode",
        ("course_pd_stiff", "heading_settling_time"),
    ),
    (
        "| error | {:.5f}° | {:.5f}° | {:.5f}° | {:.5f}° | {:.5f}° |",
        ("course_disturbed_no_learning", SECOND),
        ("course_disturbed", SECOND),
        *((f"course_disturbed_learning_{gain}", SECOND) for gain in ("0.01", "0.1", "1")),
    ),
    ("| {:.7f}° |", ("course_disturbed_learning_100", SECOND)),
    ("ship is {:.1f} m off the circle. Without disturbance it is {:.0f} m off", ("circle", FINAL), ("circle_calm", FINAL)),
    (
        "displaces the ship by {:.2f} m in 50 s and {:.2f} m in 400 s",
        ("stabilisation", "position_error_early"),
        ("stabilisation", FINAL),
    ),
    ("to {:.0e} of {:.1f} rad/s", ("circle_exact_calm", "yaw_surface_late"), ("circle_exact_calm", "yaw_surface_start")),
    ("on this circle at {:.4f} 1/s", ("circle", "growth_rate")),
    ("ship known exactly, calm | {:.0e}", ("circle_exact_calm", "reduced_deviation")),
    ("stabilisation | {:.1e}", ("stabilisation", "reduced_deviation")),
    ("straight line | {:.4f}", ("straight", "reduced_deviation")),
    ("straight line, ship known exactly | {:.4f}", ("straight_exact", "reduced_deviation")),
    ("circle, ship known exactly | {:.3f}", ("circle_exact", "reduced_deviation")),
    ("slalom, ship known exactly | {:.3f}", ("slalom_exact", "reduced_deviation")),
    ("adaptation gains 0 | {:.1f} m", ("circle_no_learning", FINAL)),
    ("case2_tracking.yaml` | {:.1f} m", ("circle", FINAL)),
    ("all γ 10 times larger | {:.1f} m", ("circle_learning_10", FINAL)),
    ("of f_v 10 times | {:.1f} m", ("circle_learning", FINAL)),
    ("of f_r 20 times | {:.1f} m", ("circle_learning_faster", FINAL)),
    ("| ship known exactly | {:.1f} m", ("circle_exact", FINAL)),
    ("| ship known exactly, calm | {:.0f} m", ("circle_exact_calm", FINAL)),
    ("(29) as printed | {:.1f} m", ("circle_as_printed", FINAL)),
    ("switching sign | {:.1f} m", ("circle_switched", FINAL)),
    ("error is −{:.2f} m when the transient has decayed", ("straight_calm", "sway_error_on_surfaces")),
    ("without disturbance it remains, {:.2f} m after 400 s", ("straight_calm", FINAL)),
    ("through zero to {:.2f} m. The slalom's {:.3f} m", ("straight", FINAL), ("slalom", FINAL)),
    ("after 800 s it is {:.1f} m", ("slalom_long", FINAL)),
    ("{:.2f} m rms in the second quarter", ("straight_a_0.1", "position_error_second_quarter")),
    ("the run ends after {:.0f} s. With a = 1", ("straight_a_0.1", "ended_at")),
    ("100 m, and the run ends after {:.1f} s", ("straight_a_1", "ended_at")),
    ("ends at {:.2f} m instead of {:.2f} m", ("circle_steep", FINAL), ("circle_60", FINAL)),
]


@pytest.mark.parametrize("quote", QUOTES, ids=lambda quote: quote[0])
def test_the_page_of_the_printed_law_quotes_the_results(quote: tuple[Any, ...]) -> None:
    text, *numbers = quote
    assert text.format(*(abs(getattr(RESULTS[run], number)) for run, number in numbers)) in PRINTED_LAW


def test_the_derived_numbers_of_the_printed_law_follow_from_the_results() -> None:
    assert f"a doubling in {math.log(2.0) / RESULTS['circle'].growth_rate:.0f} s" in PRINTED_LAW
    peaks = [1e-6 * RESULTS[run].yaw_moment_peak for run in ("course_pd_stiff", "course")]
    assert "with a peak of {:.1f} MN·m instead of {:.0f} MN·m".format(*peaks) in PRINTED_LAW
    errors = [RESULTS[f"course_pd{kind}_disturbed"] for kind in ("_stiff", "")]
    shares = [100.0 * each.heading_error_second_half_deg / each.heading_reference_second_half_deg for each in errors]
    assert "is {:.1f} % of the oscillation instead of {:.1f} %".format(*shares) in PRINTED_LAW
    assert abs(RESULTS["stabilisation"].heading_error_final_deg) < 0.006
    assert RESULTS["straight_a_0.1"].singularity_share > 0.999


def test_the_numbers_of_the_verdict_are_the_generated_ones() -> None:
    assert PAGES["verdict"] == with_results(PAGES["verdict"], RESULTS)
    assert re.findall(r"<!-- generated: (\w+) -->", PAGES["verdict"]) == ["claims", "cases", "ablations", "networks", "bounds"]
    peaks = 1e-6 * RESULTS["circle"].surge_force_peak, 1e-9 * RESULTS["circle"].yaw_moment_peak
    assert "printed law is {:.0f} MN and {:.1f} GN·m".format(*peaks) in VERDICT


def test_the_counts_of_claims_in_prose_follow_from_the_results() -> None:
    counts = [sum(claim.holds(of_law(law, RESULTS)) for claim in CLAIMS) for law in (PRINTED, REPAIRED)]
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    assert f"evaluates {len(CLAIMS)} claims: {counts[0]} hold as printed, {counts[1]} repaired" in readme
    assert f"evaluates {len(CLAIMS)} claims" in VERDICT
    assert f"{counts[0]} claims hold, 2 of these" in PRINTED_LAW


def test_errors_are_shown_as_lengths_of_two_digits() -> None:
    results = {case.name: Numbers(position_error_late=0.0123, heading_error_late_deg=0.123) for case in CASES}
    results["circle"] = Numbers(position_error_late=123.4, heading_error_late_deg=97.4)
    results[PREFIX + "circle"] = Numbers(position_error_late=0.234, heading_error_late_deg=9.96)
    page = with_results("<!-- generated: cases -->\n<!-- end -->", results)
    assert "case 2 | 123 m | 97° | 0.23 m | 10° |" in page
    assert "straight line | 12 mm | 0.12° | 12 mm | 0.12° |" in page


def test_the_verdict_names_every_claim_that_the_repaired_law_misses() -> None:
    missed = [claim.statement for claim in CLAIMS if not claim.holds(of_law(REPAIRED, RESULTS))]
    impossible = [claim for claim in CLAIMS if "no law" in claim.remark]
    assert len(missed) == 2 + 6
    assert {claim.statement for claim in impossible} <= set(missed)
    assert len(impossible) == 2


def test_the_table_of_ablations_agrees_with_the_results() -> None:
    """Its first row is the law of the results, and one neuron gives the same digits as 27."""
    rows = [[cell.strip() for cell in line.split("|")[2:-1]] for line in PAGES["verdict"].splitlines() if line.startswith("| ")]
    cells = {row[0]: row[1:] for row in rows}
    whole = [
        RESULTS[PREFIX + run].position_error_late
        for run in ("circle", "straight", "slalom", "stabilisation", "stabilisation_calm")
    ]
    assert cells["nothing"][: len(whole)] == [f"{value:.2g}" for value in whole]
    assert cells["one neuron instead of 27"] == cells["nothing"]
    assert cells["no networks"][0] == f"{RESULTS[PREFIX + 'circle_no_learning'].position_error_late:.2g}"


def test_the_verdict_fits_a_page() -> None:
    prose = [line for line in PAGES["verdict"].splitlines() if not line.startswith(("|", "<!--", "!["))]
    assert len(" ".join(prose).split()) < 900


@pytest.mark.parametrize("page", PAGES)
def test_every_link_and_picture_of_the_page_exists(page: str) -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", PAGES[page]):
        assert (DOCS / target).exists(), target


def test_the_claims_page_is_generated_from_the_results() -> None:
    assert (DOCS / "claims.md").read_text(encoding="utf-8") == claims_page(RESULTS)


def test_the_results_contain_every_case() -> None:
    assert list(RESULTS) == [case.name for case in CASES]


def test_the_results_are_what_the_code_computes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The short cases are run again; the last digits may differ on another machine."""
    monkeypatch.setattr(batch, "run_all", partial(batch.run_all, workers=1))  # processes take longer to start
    cases = [case for case in CASES if case.name in CHEAP]
    for name, result in reproduction.run_cases(cases, None, lambda _: None).items():
        expected = dataclasses.asdict(RESULTS[name])
        if "ended_at" in expected and not math.isnan(expected["ended_at"]):
            assert result.numbers.ended_at == pytest.approx(expected["ended_at"], rel=1e-2)
            continue  # a diverging run amplifies differences of rounding
        assert dataclasses.asdict(result.numbers) == pytest.approx(expected, rel=1e-5, abs=1e-12, nan_ok=True)
