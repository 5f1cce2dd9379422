"""The page of the paper's claims, and their rows for the terminal: both forms of the law next to each other."""

from vessel_hsmc_ros.studies.paper.cases import LAWS, of_law
from vessel_hsmc_ros.studies.paper.claims import CLAIMS, FINDINGS, NARROW, Claim, Finding, Results, formatted

Rows = list[tuple[str, ...]]

_PAGE = """\
# The paper's claims, measured

Written by `vessel-hsmc reproduce`. *Printed* is the law [to the letter](paper.md), *repaired* the law with
[five changes](hierarchical.md), within actuators of 2e5 N and 3e6 N·m. Both are evaluated with the same thresholds.
Errors are root mean squares over the last quarter of a run unless stated otherwise. The thresholds are ours; *narrowly* means
within {narrow:.0f} % of one. Where the paper does not give a gain, several values are listed and the best one counts.
[verdict.md](verdict.md) explains the results.

{counts}

{claims}

# The results of an independent prototype, and ours

An earlier prototype of the law as printed measured these; its adaptation gains, PD gains and course are not known.

{findings}
"""


def claims_page(results: Results) -> str:
    """Both tables, in Markdown."""
    claims: Rows = [("where", "claim", "required", *LAWS.values(), "remark")]
    claims += [
        (c.place, c.statement, c.required, *(_cell(c, law, of_law(law, results)) for law in LAWS), c.remark) for c in CLAIMS
    ]
    findings: Rows = [("what", "prototype", "here", "ratio", "")]
    findings += [finding_row(finding, results) for finding in FINDINGS]
    tables = {"claims": _markdown(claims), "findings": _markdown(findings)}
    counts = "\n".join(f"- {claims_that_hold(law, results)}" for law in LAWS)
    return _PAGE.format(counts=counts, narrow=100.0 * (NARROW - 1.0), **tables)


def claims_that_hold(law: str, results: Results) -> str:
    """How many claims hold for a form of the law, and how many of these by construction."""
    holding = [claim for claim in CLAIMS if claim.holds(of_law(law, results))]
    constructed = sum(law in claim.by_construction for claim in holding)
    return f"{LAWS[law]}: {len(holding)} of {len(CLAIMS)} claims hold, {constructed} of these by construction"


def claim_row(claim: Claim, results: Results) -> tuple[str, ...]:
    """A claim for the terminal: place, statement, and whether it holds for each form of the law."""
    return claim.place, claim.statement, *(claim.answer(of_law(law, results), law) for law in LAWS)


def finding_row(finding: Finding, results: Results) -> tuple[str, ...]:
    """A number of the prototype and ours: quantity, prototype, here, ratio, remark."""
    value = finding.measured(results)
    remark = "" if finding.agrees(results) else "differs"
    prototype = f"{finding.prototype:g}{finding.unit}"
    return finding.quantity, prototype, f"{formatted(value)}{finding.unit}", f"{value / finding.prototype:.2f}", remark


def _cell(claim: Claim, law: str, own: Results) -> str:
    answer = claim.answer(own, law)
    return f"{answer if claim.holds(own) else f'**{answer}**'}: {claim.measured(own)}"


def _markdown(rows: Rows) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
