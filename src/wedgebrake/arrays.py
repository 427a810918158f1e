"""Types of arrays."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
# Structured arrays, such as the log of a run.
Records = NDArray[np.record]
