"""The error of this package that is the user's to mend, and how messages quote what the user wrote."""

import argparse
import errno
import re
from typing import NoReturn

MOST_QUOTED = 80
# What is wrong with a disk; all else is with the path that was given.
OF_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


class ResultError(Exception):
    """A file or a request that cannot be served: not a razy file, something missing in it, an unknown name.

    The message is one line that names the file or the option; the command line prints it and exits with `exit_code`.
    """

    exit_code = 2


class DiskError(ResultError):
    """A disk that cannot take what is written: full, beyond a quota or a limit, or broken."""

    exit_code = 1


def of_system(cause: OSError, path: object = None) -> ResultError:
    """Return the error that says what the system found wrong, with `path` if it is given."""
    kind = DiskError if cause.errno in OF_DISK else ResultError
    return kind(str(cause) if path is None else f"{path}: {cause.strerror}")


def excerpt(text: str) -> str:
    """Return a text, or its beginning when it is too long for a message."""
    return text if len(text) <= MOST_QUOTED else text[: MOST_QUOTED - 3] + "..."


def one_line(message: str) -> str:
    """Return a message in one line, in which long words, but not paths of many folders, are cut."""
    words = re.sub(rf"[^\s/]{{{MOST_QUOTED + 1},}}", lambda word: excerpt(word[0]), message)
    return " ".join(words.split())


class Parser(argparse.ArgumentParser):
    """A parser of a command line whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Print the message and exit with 2."""
        self.exit(2, f"{self.prog}: error: {one_line(message)} (see {self.prog} --help)\n")
