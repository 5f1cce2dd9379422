"""`vessel-hsmc completion`: the script with which a shell completes verbs, options and the names of scenarios."""

import os
from pathlib import Path

import click
from click.shell_completion import get_completion_class

from vessel_hsmc_ros.cli.console import print_line
from vessel_hsmc_ros.core.exceptions import InstallationError

NAME, VARIABLE = "vessel-hsmc", "_VESSEL_HSMC_COMPLETE"

PLACES = {
    "bash": ".local/share/bash-completion/completions/vessel-hsmc",
    "fish": ".config/fish/completions/vessel-hsmc.fish",
    "zsh": ".zfunc/_vessel-hsmc",
}
"""Files in the home from which the shells load completions by themselves; zsh if `.zshrc` adds `~/.zfunc` to `fpath`."""


@click.command()
@click.argument("shell", type=click.Choice(list(PLACES)), required=False)
@click.option("--install", is_flag=True, help="Write the script where the shell finds it, instead of printing it.")
def completion(shell: str | None, install: bool) -> None:
    """Print or install the script with which a shell completes verbs, options and scenarios.

    SHELL is the shell of this login by default. After --install and the next login, press Tab to complete.
    """
    from vessel_hsmc_ros.cli.command import cli

    shell = shell or Path(os.environ.get("SHELL", "bash")).name
    kind = get_completion_class(shell)
    if kind is None or shell not in PLACES:
        raise click.UsageError(f"there is no completion for the shell {shell}: it takes {', '.join(PLACES)}")
    script = kind(cli, {}, NAME, VARIABLE).source()
    if not install:
        click.echo(script)
        return
    place = Path.home() / PLACES[shell]
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(script, encoding="utf-8")
    except OSError as error:
        raise InstallationError(f"{place} cannot be written: {error.strerror}") from None
    print_line(f"completion: {place}")
    if shell == "zsh":
        print_line("add to ~/.zshrc, if it is not there: fpath+=~/.zfunc; autoload -Uz compinit && compinit")
