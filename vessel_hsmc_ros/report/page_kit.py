"""The kit of all pages: one Jinja environment, the page that all extend, their style, their scripts and their origin."""

import base64
import datetime
import json
import shlex
import sys
from collections.abc import Collection, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import jinja2

from vessel_hsmc_ros.report.payload import packed
from vessel_hsmc_ros.report.style import css_variables
from vessel_hsmc_ros.scenario.run_folder import provenance

COMMAND = "vessel-hsmc"

DIAGRAM_SCRIPTS = ("data.js", "theme.js", "diagram.js", "figures.js")
"""Scripts of a page whose diagrams are complete figures of Plotly."""


class Section(NamedTuple):
    """A part of a page of sections.

    Attributes:
        text: A paragraph below it; empty for none.
        picture: A PNG picture; empty for none.
        head, lines: A table; without lines there is none.
        texts: How many columns of the table on the left are text; the others are numbers.
        prose: Whether the last column is text too.
        marked: First cells of the lines that are emphasised.
    """

    title: str
    text: str = ""
    picture: bytes = b""
    head: Sequence[str] = ()
    lines: Sequence[Sequence[str]] = ()
    texts: int = 1
    prose: bool = False
    marked: Collection[str] = ()

    @property
    def source(self) -> str:
        """The picture as a data URI."""
        return f"data:image/png;base64,{base64.b64encode(self.picture).decode()}"


def render(template: str, title: str, about: Sequence[str], *, scripts: Sequence[str], content: Any = None, **values: Any) -> str:
    """Render the HTML text of a page that extends `report/base.html`.

    `template`: the room and the file of its template, such as `report/page.html`. `scripts`: the files of its scripts, those of
    another room as `room/file`. `content`: what the scripts find as JSON in the element `content`; None for a page without
    diagrams.
    """
    return (
        _environment()
        .get_template(template)
        .render(
            title=title,
            about=about,
            origin=origin(),
            style=css_variables() + asset("report/style.css"),
            script="\n".join(asset(name if "/" in name else f"report/{name}") for name in scripts),
            # "<" escaped: a name that contains "</script>" would end the script element.
            content="" if content is None else json.dumps(content, separators=(",", ":")).replace("<", "\\u003c"),
            library="" if content is None else library(),
            **values,
        )
    )


def render_sections(title: str, about: Sequence[str], sections: Sequence[Section], findings: Sequence[str] = ()) -> str:
    """Render a page of pictures and tables.

    `findings`: sentences that stand before them: verdicts, warnings.
    """
    return render("report/sections.html", title, about, scripts=("theme.js", "static.js"), sections=sections, findings=findings)


def asset(name: str) -> str:
    """A file of a page, named by its room: a template, a style, a script."""
    room, _, file = name.partition("/")
    return (resources.files(f"vessel_hsmc_ros.{room}") / "assets" / file).read_text(encoding="utf-8")


@cache
def library() -> str:
    """Plotly's JavaScript, compressed; read as a file because importing its Python package takes long and is not needed."""
    return packed((resources.files("plotly") / "package_data" / "plotly.min.js").read_bytes())


@cache
def _environment() -> jinja2.Environment:
    # StrictUndefined: a misspelt name in the template is an error instead of an empty text.
    return jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, loader=jinja2.FunctionLoader(asset))


def origin() -> str:
    """Version, commit and date of the page, and the command that made it."""
    code = provenance()
    now = datetime.datetime.now(tz=datetime.timezone.utc)
    program, *arguments = sys.argv or [""]
    command = shlex.join([COMMAND, *arguments]) if Path(program).name == COMMAND else "the Python API"
    commit = f"commit {code['git_commit']}" if code["git_commit"] else "no git checkout"
    return f"vessel_hsmc_ros {code['version']} · {commit} · {now:%Y-%m-%d %H:%M} UTC · made by {command}"
