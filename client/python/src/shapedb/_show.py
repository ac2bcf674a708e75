# SPDX-License-Identifier: Apache-2.0
"""Draws scans over each other, with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from ._errors import InvalidInput
from ._points import FloatArray, Scan, as_points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd")


def transform(points: npt.ArrayLike, motion: npt.ArrayLike) -> FloatArray:
    """Points moved by a 4 x 4 matrix, such as `hit.motion`."""
    matrix = np.asarray(motion, dtype=np.float64)
    if matrix.shape != (4, 4):
        raise InvalidInput("invalid_argument", f"the motion has shape {matrix.shape}; it must be (4, 4)")
    moved: FloatArray = np.asarray(points, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


def show(*scans: Union[Scan, Tuple[Scan, npt.ArrayLike]], names: Optional[Sequence[str]] = None,
         ax: Optional["Axes"] = None, max_points: int = 4000) -> "Axes":
    """Draws scans in one picture, each in its colour, and returns the axes of matplotlib, which must be installed. A
    scan may come with a motion: `(points, hit.motion)`. Of larger scans about `max_points` points are drawn. In a
    program call `matplotlib.pyplot.show()` afterwards; a notebook shows the picture by itself."""
    import matplotlib.pyplot as plt
    clouds = [_cloud(scan, max_points) for scan in scans]
    if not clouds:
        raise InvalidInput("invalid_argument", "there is nothing to show")
    axes: Any = plt.figure(figsize=(7, 6)).add_subplot(projection="3d") if ax is None else ax
    for number, cloud in enumerate(clouds):
        label = names[number] if names is not None and number < len(names) else None
        axes.scatter(*cloud.T, s=2, alpha=0.5, linewidths=0, color=_COLOURS[number % len(_COLOURS)], label=label)
    low = np.min([cloud.min(axis=0) for cloud in clouds], axis=0)
    high = np.max([cloud.max(axis=0) for cloud in clouds], axis=0)
    # One scale for all three axes: shapes are to look as they are.
    middle, reach = 0.5 * (low + high), 0.5 * float((high - low).max()) or 1.0
    axes.set(xlim=(middle[0] - reach, middle[0] + reach), ylim=(middle[1] - reach, middle[1] + reach),
             zlim=(middle[2] - reach, middle[2] + reach))
    axes.set_box_aspect((1, 1, 1))
    if names is not None:
        axes.legend(markerscale=5, loc="upper left")
    result: "Axes" = axes
    return result


def _cloud(scan: Any, max_points: int) -> FloatArray:
    motion = None
    if isinstance(scan, tuple) and len(scan) == 2 and np.shape(scan[1]) == (4, 4):
        scan, motion = scan
    points = as_points(scan)
    if len(points) > max_points:
        points = points[np.random.default_rng(1).choice(len(points), max_points, replace=False)]
    return points if motion is None else transform(points, motion)
