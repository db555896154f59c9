"""The error of this package that is the user's to mend."""


class ResultError(Exception):
    """A file or a request that cannot be served: not a razy file, something missing in it, an unknown name.

    The message is one line that names the file or the option; the command line prints it and exits with 2.
    """
