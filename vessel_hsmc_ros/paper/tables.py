"""The results as tables: claims.md, which is also a page of the docs, and rows for the terminal."""

from vessel_hsmc_ros.paper.checks import Claim, Results, formatted
from vessel_hsmc_ros.paper.claims import CLAIMS
from vessel_hsmc_ros.paper.errata import FINDINGS, Finding

Rows = list[tuple[str, ...]]

_PAGE = """\
# The paper's claims, measured

Written by `vessel-hsmc reproduce`. *Last quarter*: errors are root mean squares over the last quarter of a run unless stated
otherwise. The thresholds in parentheses are ours; [verdict.md](verdict.md) explains the results.

{holding} of {all} claims hold.

{claims}

# The results of an independent prototype, and ours

An earlier prototype of the law measured these; its adaptation gains, PD gains and course are not known.

{findings}
"""


def claims_page(results: Results) -> str:
    """Both tables, in Markdown."""
    claims: Rows = [("where", "claim", "measured", "holds")]
    claims += [(c.place, c.statement, c.measured(results), _yes_or_no(c.holds(results))) for c in CLAIMS]
    findings: Rows = [("what", "prototype", "here", "ratio", "")]
    findings += [finding_row(finding, results) for finding in FINDINGS]
    holding = sum(claim.holds(results) for claim in CLAIMS)
    return _PAGE.format(holding=holding, all=len(CLAIMS), claims=_markdown(claims), findings=_markdown(findings))


def claim_row(claim: Claim, results: Results) -> tuple[str, str, str]:
    """A claim for the terminal: place, statement, whether it holds."""
    return claim.place, claim.statement, _yes_or_no(claim.holds(results))


def finding_row(finding: Finding, results: Results) -> tuple[str, ...]:
    """A number of the prototype and ours: quantity, prototype, here, ratio, remark."""
    value = finding.measured(results)
    # An unexplained difference is reported too.
    remark = "" if finding.agrees(results) else f"differs{': ' if finding.reason else ''}{finding.reason}"
    prototype = f"{finding.prototype:g}{finding.unit}"
    return finding.quantity, prototype, f"{formatted(value)}{finding.unit}", f"{value / finding.prototype:.2f}", remark


def _yes_or_no(holds: bool) -> str:
    return "yes" if holds else "**no**"


def _markdown(rows: Rows) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
