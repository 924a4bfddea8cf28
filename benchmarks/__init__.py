"""Speed tables: ``make bench``.  Ratios are taken side by side in one run; absolute times depend on the machine.

Scenes, checks and figures that the tests need too stand beside them, in ``test/``.
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent.parent / "test" / "helpers"))
