"""``python -m trunnion``: the same as the command ``trunnion``."""

import sys

from trunnion.cli import main

sys.exit(main())
