# SPDX-License-Identifier: Apache-2.0
"""What the readers of formats produce: vertices, and triangles."""

from __future__ import annotations

import math
from typing import Callable, List, Sequence

import numpy as np
import numpy.typing as npt

from ._points import FloatArray
from ._scan_words import not_finite

Triangles = npt.NDArray[np.int64]


class Content:
    def __init__(self) -> None:
        self.skipped = 0
        """Points of a PCD file whose coordinates say that nothing was measured there."""
        self.ignored: List[str] = []
        """What of the file may have been faces, but was not read as such."""
        self.vertex_count = 0
        self._vertices: List[FloatArray] = []
        self._few: List[Sequence[float]] = []
        self._triangles: List[Triangles] = []
        self._few_triangles: List[Sequence[int]] = []

    @property
    def vertices(self) -> FloatArray:
        self._gather()
        return np.concatenate([np.zeros((0, 3)), *self._vertices])

    @property
    def triangles(self) -> Triangles:
        self._gather()
        return np.concatenate([np.zeros((0, 3), dtype=np.int64), *self._triangles])

    @property
    def has_triangles(self) -> bool:
        return bool(self._few_triangles or self._triangles)

    def add_vertex(self, x: float, y: float, z: float, where: Callable[[], str]) -> None:
        """`where`: "line 7" or "byte 132"."""
        if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
            raise not_finite(where(), self.vertex_count)
        self._few.append((x, y, z))
        self.vertex_count += 1

    def add_vertices(self, points: FloatArray, where: Callable[[int], str]) -> None:
        """`where`: of the one with this number among these."""
        good = np.isfinite(points).all(axis=1)
        if not good.all():
            first = int(np.argmin(good))
            raise not_finite(where(first), self.vertex_count + first)
        self._gather()
        self._vertices.append(points)
        self.vertex_count += len(points)

    def add_fan(self, corners: Sequence[int]) -> None:
        """Splits a polygon into triangles. Those with a repeated vertex have no area."""
        for i in range(1, len(corners) - 1):
            self._add_triangle(corners[0], corners[i], corners[i + 1])

    def add_strip(self, corners: Sequence[int]) -> None:
        """Every second triangle of a strip is wound the other way."""
        for i in range(2, len(corners)):
            a, b = corners[i - 2], corners[i - 1]
            self._add_triangle(*((b, a) if i % 2 else (a, b)), corners[i])

    def add_fans(self, polygons: npt.NDArray[np.int64]) -> None:
        """Polygons of one length, a row each."""
        self._gather()
        fans = [polygons[:, [0, i, i + 1]] for i in range(1, polygons.shape[1] - 1)]
        if not fans:
            return
        triangles = np.stack(fans, axis=1).reshape(-1, 3)
        a, b, c = triangles.T
        triangles = triangles[(a != b) & (b != c) & (c != a)]
        if len(triangles):
            self._triangles.append(triangles)

    def _add_triangle(self, a: int, b: int, c: int) -> None:
        if a != b and b != c and c != a:
            self._few_triangles.append((a, b, c))

    def _gather(self) -> None:
        if self._few:
            self._vertices.append(np.array(self._few, dtype=np.float64))
            self._few = []
        if self._few_triangles:
            self._triangles.append(np.array(self._few_triangles, dtype=np.int64))
            self._few_triangles = []
