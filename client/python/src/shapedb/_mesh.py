# SPDX-License-Identifier: Apache-2.0
"""Points of a mesh: its vertices where these are what was measured, samples of its surface otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InvalidInput
from ._points import FloatArray

SAMPLES = 20_000
# As `shapedb add` decides, docs/file-formats.md: vertices are nowhere fewer than samples would be if this share of the
# area lies in triangles whose longest edge is at most so many times the mean spacing of the samples.
_DENSE_AREA = 0.99
_LONGEST_EDGE = 3.0


def points_of_mesh(vertices: Any, triangles: npt.NDArray[np.int64], samples: int = SAMPLES,
                   seed: int = 1) -> FloatArray:
    """The vertices if less than half of them belong to a triangle, if they are a dense sample of the surface
    themselves, or if the triangles have no area; else `samples` points of the surface, uniform by area. The same mesh
    gives the same points."""
    points: FloatArray = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
    if len(triangles) == 0:
        return points
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.min() < 0 or triangles.max() >= len(points):
        raise InvalidInput("malformed_file", f"a triangle names a vertex that is not among the {len(points)}")
    corners = points[triangles]
    edges = corners - np.roll(corners, 1, axis=1)
    with np.errstate(over="ignore", invalid="ignore"):
        areas = 0.5 * np.linalg.norm(np.cross(edges[:, 1], edges[:, 2]), axis=1)
        area = float(areas.sum())
    if not (np.isfinite(area) and area > 0.0) or 2 * len(np.unique(triangles)) < len(points):
        return points
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    fine = float(areas[longest <= _LONGEST_EDGE * np.sqrt(area / samples)].sum())
    if len(points) >= samples and fine >= _DENSE_AREA * area:
        return points
    random = np.random.default_rng(seed)
    chosen = np.searchsorted(np.cumsum(areas), random.random(samples) * area, side="right").clip(max=len(areas) - 1)
    a, b, c = corners[chosen].transpose(1, 0, 2)
    # Uniform in a triangle (Osada et al., "Shape distributions", section 3.1).
    root, along = np.sqrt(random.random((samples, 1))), random.random((samples, 1))
    sampled: FloatArray = (1.0 - root) * a + root * (1.0 - along) * b + root * along * c
    return sampled
