"""razy's programs: where they are, how they are run, and the cases that they read."""

from razy.programs.process import find_program as find_program
