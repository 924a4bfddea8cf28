"""Clipping: a single stroke of indirect light brings only so much to its own pixel, and what it has beyond is shared by all of them.

Few strokes of light are hundreds of times as bright as white: a path that happens to meet the patch where the sun falls, say.  In a
picture of few samples each is a speck; simply cut off, as is common, they leave the picture darker and of another colour.  Here what is
cut off is gathered, and the indirect light of all pixels is made brighter by one factor for each channel, so that the picture's mean is
that of the strokes before.  What is lost is where that light was.

A stroke counts up to :data:`CLIPPED_REACH` times the limit, or else one alone could light a whole picture; what is beyond that is lost.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from renderer.path.records import Film

CLIPPED_REACH = np.float32(16.0)
_STEPS = 4096.0
"""Factors come in steps, so that they agree on processors that add in another order."""


def share_clipped(film: Film) -> None:
    """Give the means of a film's clipped light to its indirect light, in place, with ``squares`` to match.

    ``film``: with ``direct`` and ``clipped``; where there is no indirect light nothing is given.
    """
    for channel in range(3):
        light, direct = film.light[..., channel], film.direct[..., channel]
        indirect = np.maximum(light - direct, np.float32(0.0))
        kept, clipped = (float(part.sum(dtype=np.float64)) for part in (indirect, film.clipped[..., channel]))
        gain = round(_STEPS * clipped / kept) / _STEPS if kept > 0.0 else 0.0
        shared = light + np.float32(gain) * indirect
        if len(film.squares):
            film.squares[..., channel] *= np.divide(shared, light, out=np.ones_like(light), where=light > 0.0) ** 2
        light[...] = shared
