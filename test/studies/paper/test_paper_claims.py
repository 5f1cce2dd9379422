"""The claims as data: complete, referring to existing runs and numbers, and each able to hold and to fail."""

import dataclasses
import math

import pytest

from vessel_hsmc_ros.studies.paper.cases import (
    CASES,
    CLAIMS,
    LAWS,
    PREFIX,
    PRINTED,
    PRINTED_CASES,
    REPAIRED,
    REPAIRED_CASES,
    Check,
    Claim,
    Numbers,
    claims_page,
    formatted,
    of_law,
)

NAMES = {case.name for case in PRINTED_CASES}
FIELDS = {field.name for field in dataclasses.fields(Numbers)}


def every_check() -> list[Check]:
    return [check for claim in CLAIMS for check in claim.checks]


def results_for(check: Check, factor: float) -> dict[str, Numbers]:
    """Numbers of all runs for which the value of a check is `factor` times a value that meets its threshold."""
    if check.above is not None:
        value = 1.5 * check.above
    else:
        assert check.below is not None
        value = 0.5 * check.below
    results = {name: Numbers() for name in NAMES}
    if check.over is not None:
        run, number = check.over
        results[run] = dataclasses.replace(results[run], **{number: 1.0})
    results[check.run] = dataclasses.replace(results[check.run], **{check.number: value * factor})
    if check.over == (check.run, check.number):
        pytest.fail("the ratio of a number to itself is always 1")
    return results


def test_every_claim_has_a_place_a_statement_and_checks() -> None:
    assert len(CLAIMS) >= 25
    assert len({(claim.place, claim.statement) for claim in CLAIMS}) == len(CLAIMS)
    for claim in CLAIMS:
        assert claim.place
        assert claim.statement
        assert claim.checks


def test_claims_refer_to_existing_runs_and_numbers() -> None:
    assert len({case.name for case in CASES}) == len(CASES)
    pairs = [(check.run, check.number) for check in every_check()] + [check.over for check in every_check() if check.over]
    for run, number in pairs:
        assert run in NAMES
        assert number in FIELDS


def test_every_check_is_evaluated_for_both_forms_of_the_law() -> None:
    """Only runs with gains that the repaired law does not leave open are missing."""
    outcomes = {case.name: case for case in CASES}
    for law in LAWS:
        own = of_law(law, outcomes)
        for check in every_check():
            assert {check.run, *([check.over[0]] if check.over else [])} <= set(own), (law, check)
        scenarios = {name: case.changes.get("controller.law") for name, case in own.items() if not name.startswith("course")}
        assert set(scenarios.values()) == ({REPAIRED} if law == REPAIRED else {None})
    assert {case.name.removeprefix(PREFIX) for case in REPAIRED_CASES} < NAMES


def test_a_run_of_the_repaired_law_changes_nothing_that_only_the_printed_one_has() -> None:
    for case in REPAIRED_CASES:
        assert not [name for name in case.changes if "hierarchical_printed" in name], case.name
        assert case.by_nodes is not bool(case.exact or case.constants)


@pytest.mark.parametrize("check", every_check(), ids=lambda check: f"{check.run}-{check.number}")
def test_every_check_holds_above_its_threshold_and_fails_below(check: Check) -> None:
    assert check.holds(results_for(check, 1.0))
    missed = 1e-3 if check.above is not None else 1e3
    assert not check.holds(results_for(check, missed))
    assert not check.holds({name: Numbers() for name in NAMES}), "NaN meets no threshold"


def test_a_claim_holds_only_if_all_its_checks_hold() -> None:
    (claim,) = [claim for claim in CLAIMS if claim.statement.startswith("one controller")]
    good = {name: Numbers(position_error_late=0.2) for name in NAMES}
    assert claim.holds(good)
    bad = {**good, "stabilisation": Numbers(position_error_late=2.0)}
    assert not claim.holds(bad)
    assert claim.measured(bad) == "0.2 m; 2 m"
    assert claim.required == "circle, position error ≤ 1 m; stabilisation, position error ≤ 1 m"


def test_a_check_may_have_a_lower_and_an_upper_threshold() -> None:
    check = Check("time", "course_pd", "heading_settling_time", above=63.0, below=126.0, unit=" s")
    for value, holds in ((10.0, False), (100.0, True), (130.0, False), (math.nan, False)):
        assert check.holds({"course_pd": Numbers(heading_settling_time=value)}) is holds
    assert check.measured({"course_pd": Numbers(heading_settling_time=95.0)}) == "95 s"
    assert check.required == "time ≤ 126 s and ≥ 63 s"


def test_a_value_at_its_threshold_meets_it() -> None:
    check = Check("force", "circle", "surge_force_peak", below=2e5)
    for value, holds in ((2e5, True), (math.nextafter(2e5, 3e5), False)):
        assert check.holds({"circle": Numbers(surge_force_peak=value)}) is holds


def test_a_ratio_to_zero_is_infinite() -> None:
    check = Check("ratio", "circle", "yaw_surface_late", above=0.1, over=("circle", "weighted_sway_surface_late"))
    zero = {"circle": Numbers(yaw_surface_late=0.0, weighted_sway_surface_late=0.0)}
    assert check.holds(zero)
    assert check.measured(zero) == "∞"


def test_of_several_runs_the_best_counts() -> None:
    check = Check("error", "circle", "position_error_late", below=1.0, also=("circle_learning", "circle_60"))
    results = {name: Numbers() for name in NAMES} | {
        "circle": Numbers(position_error_late=2.0),
        "circle_learning": Numbers(position_error_late=0.5),
    }
    assert check.value(results) == 0.5
    assert check.holds(results)
    assert (check.required, check.measured(results)) == ("error best ≤ 1", "2, 0.5, never")
    del results["circle_60"]
    assert check.measured(results) == "2, 0.5"
    assert not dataclasses.replace(check, below=None, above=3.0).holds(results)


def test_an_answer_names_what_holds_by_construction_and_what_holds_narrowly() -> None:
    def answer(value: float, other: float = 0.1, by_construction: tuple[str, ...] = ()) -> str:
        checks = [Check("error", run, "position_error_late", below=1.0) for run in ("circle", "straight")]
        results = {"circle": Numbers(position_error_late=value), "straight": Numbers(position_error_late=other)}
        return Claim("here", "it tracks", tuple(checks), by_construction).answer(results, PRINTED)

    assert answer(0.5) == "yes"
    assert answer(0.9) == answer(0.5, 0.9) == "yes, narrowly"
    assert answer(1.1) == "no, narrowly"
    assert answer(1.1, 5.0) == answer(5.0) == answer(math.nan) == "no"
    assert answer(0.5, by_construction=(PRINTED,)) == "by construction"
    assert answer(5.0, by_construction=(PRINTED,)) == "no"


def test_the_page_has_a_row_for_each_claim() -> None:
    page = claims_page({case.name: Numbers() for case in CASES})
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    assert len(rows) == len(CLAIMS) + 1
    for words in LAWS.values():
        assert f"- {words}: 0 of {len(CLAIMS)} claims hold" in page
    assert "never" in page


def test_numbers_are_formatted_with_three_significant_digits() -> None:
    assert [formatted(v) for v in (0.12345, 30864534.9, math.nan)] == ["0.123", "3.09e+07", "never"]
