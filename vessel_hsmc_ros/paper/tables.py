"""The results as tables: claims.md, which is also a page of the docs, and rows for the terminal."""

from vessel_hsmc_ros.paper.checks import NARROW, Claim, Results, formatted
from vessel_hsmc_ros.paper.claims import CLAIMS
from vessel_hsmc_ros.paper.errata import FINDINGS, Finding

Rows = list[tuple[str, ...]]

_PAGE = """\
# The paper's claims, measured

Written by `vessel-hsmc reproduce`. *Last quarter*: errors are root mean squares over the last quarter of a run unless stated
otherwise. The thresholds in parentheses are ours; *narrowly* means within {narrow:.0f} % of one. Where the paper does not give a
gain, several values are listed and the best one counts. [verdict.md](verdict.md) explains the results.

{count}.

{claims}

# The results of an independent prototype, and ours

An earlier prototype of the law measured these; its adaptation gains, PD gains and course are not known.

{findings}
"""


def claims_page(results: Results) -> str:
    """Both tables, in Markdown."""
    claims: Rows = [("where", "claim", "measured", "holds", "remark")]
    claims += [(c.place, c.statement, c.measured(results), _answer(c, results), c.remark) for c in CLAIMS]
    findings: Rows = [("what", "prototype", "here", "ratio", "")]
    findings += [finding_row(finding, results) for finding in FINDINGS]
    tables = {"claims": _markdown(claims), "findings": _markdown(findings)}
    return _PAGE.format(count=claims_that_hold(results), narrow=100.0 * (NARROW - 1.0), **tables)


def claims_that_hold(results: Results) -> str:
    """How many claims hold, and how many of these by construction."""
    holding = [claim for claim in CLAIMS if claim.holds(results)]
    constructed = sum(claim.by_construction for claim in holding)
    return f"{len(holding)} of {len(CLAIMS)} claims hold, {constructed} of these by construction"


def claim_row(claim: Claim, results: Results) -> tuple[str, str, str]:
    """A claim for the terminal: place, statement, whether it holds."""
    return claim.place, claim.statement, _answer(claim, results)


def finding_row(finding: Finding, results: Results) -> tuple[str, ...]:
    """A number of the prototype and ours: quantity, prototype, here, ratio, remark."""
    value = finding.measured(results)
    # An unexplained difference is reported too.
    remark = "" if finding.agrees(results) else f"differs{': ' if finding.reason else ''}{finding.reason}"
    prototype = f"{finding.prototype:g}{finding.unit}"
    return finding.quantity, prototype, f"{formatted(value)}{finding.unit}", f"{value / finding.prototype:.2f}", remark


def _answer(claim: Claim, results: Results) -> str:
    answer = claim.answer(results)
    return answer if claim.holds(results) else f"**{answer}**"


def _markdown(rows: Rows) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
