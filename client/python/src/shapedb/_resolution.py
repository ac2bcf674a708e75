# SPDX-License-Identifier: Apache-2.0
"""How finely single precision holds the coordinates of a scan, as core/geometry/resolution.h tells."""

from __future__ import annotations

from typing import NamedTuple, Optional

import numpy as np
import numpy.typing as npt

from ._errors import InvalidInput

FloatArray = npt.NDArray[np.float64]

_LARGEST = float(np.finfo(np.float32).max)
_LEAST_STEPS = 1000.0
_LEAST_STEPS_OF_AXIS = 64.0
_FLAT_SHARE = 1e-6
_LEAST_ODD_SHARE = 0.125
# A float32 rounds a coordinate beyond this many box diagonals by more than a millionth of the diagonal.
_FAR_FROM_ORIGIN = 16.0
# Outliers are beyond so many diagonals of the box of the middle half; of less, where that is a point. As
# core/geometry/main_part.h tells.
_MAIN_REACH = 4.0
_SAMPLE = 65_536
_SHARES = (0.25, 0.1, 0.01)


class Coarse(NamedTuple):
    """Why single precision cannot hold a scan. Scan units."""

    largest: float
    """Coordinate, by magnitude."""
    step: float
    """From there to the next number."""
    across: float
    """Size of the scan, or its extent along the axis that is concerned."""
    outliers: int = 0
    """Points that were left out, because they lie far from the others."""

    def text(self) -> str:
        text = (f"coordinates up to {self.largest:.6g} are {self.step:.3g} apart in single precision, but the scan is only "
                f"{self.across:.3g} across")
        if self.outliers == 0:
            return text
        return f"{text}, without {self.outliers:,} point{'s' if self.outliers > 1 else ''} far from the others"


def _steps(magnitudes: FloatArray) -> FloatArray:
    singles = np.minimum(magnitudes, np.nextafter(np.float32(_LARGEST), np.float32(0))).astype(np.float32)
    steps: FloatArray = np.spacing(singles).astype(np.float64)
    return steps


def size_of(low: FloatArray, high: FloatArray) -> float:
    extent = high - low
    return float(np.hypot(np.hypot(extent[0], extent[1]), extent[2]))


def _within(points: FloatArray, sample: FloatArray, share: float) -> FloatArray:
    """What lies within reach of the middle of the sample."""
    left_out = int(share * (len(sample) - 1))
    ranks = [left_out, len(sample) - 1 - left_out]
    low, high = np.partition(sample, ranks, axis=0)[ranks]
    reach = _MAIN_REACH * size_of(low, high)
    if reach > 0.0:
        centre = 0.5 * low + 0.5 * high
        low, high = centre - reach, centre + reach
    part: FloatArray = points[((points >= low) & (points <= high)).all(axis=1)]
    return part


def main_part(points: FloatArray) -> FloatArray:
    """The points without outliers: more than half of them, whatever up to a quarter do."""
    sample = points[::-(-len(points) // _SAMPLE)]
    point = points
    for share in _SHARES:
        part = _within(points, sample, share)
        if 2 * len(part) <= len(points):
            continue
        if (part.min(axis=0) < part.max(axis=0)).any():
            return part
        point = part
    return point


def coarse_in_single_precision(low: FloatArray, high: FloatArray, points: int) -> Optional[Coarse]:
    """None if it holds them, and for points that are all equal."""
    size, extents = size_of(low, high), high - low
    largest = np.maximum(np.abs(low), np.abs(high))
    steps = _steps(largest)
    if size > 0.0 and float(steps.max()) * max(_LEAST_STEPS, points**0.5) > size:
        return Coarse(float(largest.max()), float(steps.max()), size)
    for axis in range(3):
        if extents[axis] > _FLAT_SHARE * size and steps[axis] * _LEAST_STEPS_OF_AXIS > extents[axis]:
            return Coarse(float(largest[axis]), float(steps[axis]), float(extents[axis]))
    return None


def check_not_rounded(points: FloatArray) -> None:
    """Refuses points that were rounded to single precision where that cannot hold them: what is left is not the shape that
    was scanned. Points on a coarser grid lost nothing and pass, and what is not finite is left to other checks."""
    if not len(points) or not np.isfinite(points).all() or np.abs(points).max() > _LARGEST:
        return
    if (points.astype(np.float32).astype(np.float64) != points).any():
        return
    part = main_part(points)
    found = coarse_in_single_precision(part.min(axis=0), part.max(axis=0), len(part))
    if found is None:
        return
    odd = (_steps(np.abs(points)) >= found.step) & (np.fmod(points, 2.0 * found.step) != 0.0)
    if np.count_nonzero(odd.any(axis=1)) < _LEAST_ODD_SHARE * len(points):
        return
    raise InvalidInput(
        "coordinate_out_of_range",
        found._replace(outliers=len(points) - len(part)).text() + ", and all of them are such numbers: the shape was lost when "
        "they were written in single precision. Write them again in double precision, or relative to a point near the scan")


def origin_of(points: FloatArray) -> FloatArray:
    """What to subtract before points become single precision: the centre of their box, without outliers, if they lie so far
    from the origin that rounding would hurt their shape, else zero."""
    part = main_part(points)
    if (part.min(axis=0) == part.max(axis=0)).all():
        part = points
    low, high = part.min(axis=0), part.max(axis=0)
    size = size_of(low, high)
    far = size > 0.0 and float(max(np.abs(low).max(), np.abs(high).max())) > _FAR_FROM_ORIGIN * size
    if not far and coarse_in_single_precision(low, high, len(part)) is None:
        return np.zeros(3)
    centre: FloatArray = low + 0.5 * (high - low)
    return centre
