"""What can go wrong for a user, and the exit code each kind ends with.

Every message is one line: the file, what was found, what was expected, what to do. The command line prints it
and exits with `exit_code`; nothing else in the program turns an error into text.
"""


class DreammatError(Exception):
    """A failure that the user can act on; shown as one line, never as a traceback."""

    exit_code = 1


class InputError(DreammatError):
    """A file given by the user cannot be used: unreadable, malformed, or its content is out of range."""

    exit_code = 3


class ArtifactError(DreammatError):
    """An artefact is missing, foreign, corrupt, incomplete, or was made from something else."""

    exit_code = 4


class OutputError(DreammatError):
    """The result cannot be written: no space, no permission, or a file stands where a folder should be."""

    exit_code = 5


class NumericalError(DreammatError):
    """A value that must be finite is not; the message names step, view, pixel or seed."""

    exit_code = 6


def one_line(error: BaseException | str) -> str:
    """What another library says, short enough to be part of a line."""
    return " ".join(str(error).split())[:160] or type(error).__name__
