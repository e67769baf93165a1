"""``python -m wrcore`` is the command ``wrcore``."""

import sys

from wrcore.cli import main

if __name__ == "__main__":
    sys.exit(main())
