"""dreammat completion: what a shell needs to complete commands, options and paths."""

import click
from click.shell_completion import get_completion_class

from dreammat_cli.common import examples

WHERE = {
    "bash": '  echo \'eval "$(dreammat completion bash)"\' >> ~/.bashrc',
    "zsh": '  echo \'eval "$(dreammat completion zsh)"\' >> ~/.zshrc',
    "fish": "  dreammat completion fish > ~/.config/fish/completions/dreammat.fish",
}


@click.command(
    epilog=examples("dreammat completion bash") + "\n\n\b\nTo have it in every new shell:\n" + "\n".join(WHERE.values())
)
@click.argument("shell", type=click.Choice(tuple(WHERE)))
def command(shell: str) -> None:
    """Print the script that makes SHELL complete dreammat's commands and options."""
    from dreammat_cli.main import cli

    chosen = get_completion_class(shell)
    assert chosen is not None
    click.echo(chosen(cli, {}, "dreammat", "_DREAMMAT_COMPLETE").source())
