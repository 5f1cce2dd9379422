"""Hook of mkdocs: put the help texts of `vessel-hsmc` and its verbs into the page of the command."""

from typing import Any

import click

from vessel_hsmc_ros.cli.command import cli

PLACE = "<!-- help of the command -->"


def help_text(command: click.Command, name: str, parent: click.Context | None = None) -> str:
    """Return a section with the help of a command, followed by those of its subcommands."""
    context = click.Context(command, info_name=name, parent=parent, max_content_width=110, terminal_width=110)
    section = f"## {context.command_path}\n\n```text\n{command.get_help(context)}\n```\n\n"
    if isinstance(command, click.Group):
        verbs = command.list_commands(context)
        section += "".join(help_text(each, verb, context) for verb in verbs if (each := command.get_command(context, verb)))
    return section


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the place holder; mkdocs calls this for every page."""
    if PLACE not in markdown:
        return markdown
    return markdown.replace(PLACE, help_text(cli, "vessel-hsmc"))
