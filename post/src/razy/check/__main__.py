"""``python -m razy.check`` is ``razy-check``."""

import sys

from razy.check.cli import main

if __name__ == "__main__":
    sys.exit(main())
