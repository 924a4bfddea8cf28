"""Types of arrays that many modules share."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Numbers of geometry and colour before they are tabulated for kernels."""
