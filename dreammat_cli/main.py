"""The `dreammat` command. Each subcommand lives in a file of its own and is imported only when it is called."""

import importlib
import os
import signal
import sys
from importlib.metadata import version

import click

from dreammat_cli.common import Guessing
from stages.core.errors import DreammatError, OutputError, one_line

COMMANDS = {
    "run": "Texture a mesh: prep, conditions, distill and bake in one call.",
    "prep": "Read, check, mend and unwrap a mesh.",
    "parts": "List the parts of a prepared mesh by name, and draw them.",
    "conditions": "Ray-trace geometry and light around the mesh.",
    "distill": "Optimise the material for a prompt.",
    "bake": "Write textures and a model with the material.",
    "edit": "Change colours, roughness and metallic of an asset, whole or by part.",
    "assemble": "Put assets of a scene's objects together again.",
    "export": "Write an asset for Blender, Unreal, Unity, the web, USD or MaterialX.",
    "material": "Write tiling maps of a material from a prompt alone.",
    "report": "Measure speed against error.",
    "plan": "Say what many jobs will cost, before they run.",
    "summary": "Say what has become of many jobs.",
    "train": "Train the diffusion models.",
    "eval": "Measure assets: CLIP score and FID.",
    "doctor": "Check this machine, and say how to mend what is wrong.",
    "completion": "Print what a shell needs to complete commands and options.",
}

INTERRUPTED = 130

STOPPED = "interrupted; the same command continues where it stopped"

OUT_OF_MEMORY = "out of memory; try fewer or smaller --views of conditions, a smaller --size of bake, or a simpler mesh"


class LazyGroup(Guessing):
    """Imports a subcommand's module when it is called, so that --help is instant."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        super().get_command(context, name)
        return importlib.import_module(f"dreammat_cli.{name}").command if name in COMMANDS else None

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(version("dreammat"), prog_name="dreammat")
def cli() -> None:
    """Physically based materials for untextured meshes, from a text prompt.

    \b
    dreammat run        MESH --prompt TEXT          -o FOLDER/

    does all that is needed to texture a mesh; it is these four in one:

    \b
    dreammat prep       MESH                        -o PREP.npz
    dreammat conditions PREP.npz                    -o CONDITIONS/
    dreammat distill    CONDITIONS/ --prompt TEXT   -o MATERIAL.npz
    dreammat bake       PREP.npz MATERIAL.npz       -o ASSET/

    Every command can be stopped and run again: it continues, or says that its output is up to date.

    \b
    Exit codes: 0 done, 2 wrong usage, 3 unusable input file, 4 missing, damaged or
    foreign artefact, 5 output cannot be written, 6 not finite, 130 interrupted.
    """


def main() -> None:
    """Entry point: errors become one line and an exit code; SIGTERM ends like Ctrl-C, in a state that resumes."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # threads of torch that wait leave their core to others
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # those of numpy and scipy would not, and their matrices are small
    try:
        cli(standalone_mode=False)
    except DreammatError as error:
        fail(str(error), error.exit_code)
    except click.exceptions.Exit as error:
        sys.exit(error.exit_code)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "dreammat"
        fail(f"{error.format_message().rstrip('.')}; see {command} --help", error.exit_code)
    except click.ClickException as error:
        fail(error.format_message(), error.exit_code)
    except (KeyboardInterrupt, click.Abort):
        fail(STOPPED, INTERRUPTED)
    except MemoryError:
        fail(OUT_OF_MEMORY, OutputError.exit_code)
    except RuntimeError as error:
        if not any(words in str(error) for words in ("allocate memory", "out of memory", "bad_alloc", "start new thread")):
            raise
        fail(OUT_OF_MEMORY, OutputError.exit_code)
    except ImportError as error:
        if interrupted(error):
            fail(STOPPED, INTERRUPTED)
        package = (error.name or "a package").split(".")[0]
        if package in ("dreammat_cli", "stages"):
            raise
        fail(f"{package} cannot be loaded: {one_line(error)}; dreammat doctor says how to mend it", OutputError.exit_code)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


def interrupted(error: BaseException | None) -> bool:
    """Whether an error came of a signal, as when it meets a package that is just being loaded."""
    return error is not None and (isinstance(error, KeyboardInterrupt) or interrupted(error.__cause__ or error.__context__))


def fail(message: str, code: int) -> None:
    """Print one line to stderr and exit."""
    click.echo(click.style("error: ", fg="red") + " ".join(message.split()), err=True)
    sys.exit(code)
