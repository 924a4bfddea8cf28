"""Linear RGB with Rec. 709 primaries."""

from __future__ import annotations

import numpy as np

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear RGB with Rec. 709 primaries in luminance (ITU-R BT.709)."""
