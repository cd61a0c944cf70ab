"""Makes the ``reference`` package beside this folder importable, wherever the tests run from."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
