"""Hook of mkdocs: turn equations in LaTeX into MathML, which browsers render without a script or a request."""

import html
import re
from typing import Any

from latex2mathml.converter import convert

EQUATION = re.compile(r'<(?:span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</(?:span|div)>', re.DOTALL)


def on_page_content(content: str, **_: Any) -> str:
    """Replace what the extension arithmatex has found; mkdocs calls this for every page."""
    return EQUATION.sub(lambda found: convert(html.unescape(found[2]), display="block" if found[1] == "[" else "inline"), content)
