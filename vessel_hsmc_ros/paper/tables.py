"""The results as people read them: claims.md, which is a page of the docs as well."""

from vessel_hsmc_ros.paper.checks import Claim, Results, figure
from vessel_hsmc_ros.paper.claims_proof import CLAIMS
from vessel_hsmc_ros.paper.errata import FINDINGS, Finding

Rows = list[tuple[str, ...]]

_PAGE = """\
# The paper's claims, measured

Written by `vessel-hsmc reproduce`. *Last quarter*: errors are root mean squares over the last quarter of a run unless said
otherwise. What is between brackets is asked for here, by us; [verdict.md](verdict.md) says why things are as they are.

{holding} of {all} claims hold.

{claims}

# The prototype's figures beside ours

An earlier prototype of the law measured these; its adaptation gains, PD gains and course are not known.

{findings}
"""


def claims_page(results: Results) -> str:
    """Both tables, in Markdown."""
    claims: Rows = [("where", "claim", "measured", "holds")]
    claims += [(c.place, c.words, c.measured(results), yes(c.holds(results))) for c in CLAIMS]
    findings: Rows = [("what", "prototype", "here", "ratio", "")]
    findings += [finding_row(finding, results) for finding in FINDINGS]
    holding = sum(claim.holds(results) for claim in CLAIMS)
    return _PAGE.format(holding=holding, all=len(CLAIMS), claims=_markdown(claims), findings=_markdown(findings))


def claim_row(claim: Claim, results: Results) -> tuple[str, str, str]:
    """A claim in short, for a terminal."""
    return claim.place, claim.words, yes(claim.holds(results))


def finding_row(finding: Finding, results: Results) -> tuple[str, ...]:
    """One figure of the prototype and ours."""
    ours = finding.ours(results)
    alike = "" if finding.alike(results) else f"differs{': ' if finding.why else ''}{finding.why}"
    theirs = f"{finding.theirs:g}{finding.unit}"
    return finding.words, theirs, f"{figure(ours)}{finding.unit}", f"{ours / finding.theirs:.2f}", alike


def yes(holds: bool) -> str:
    """The verdict."""
    return "yes" if holds else "**no**"


def _markdown(rows: Rows) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])
