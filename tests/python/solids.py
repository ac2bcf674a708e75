# SPDX-License-Identifier: Apache-2.0
"""Solids that are told apart: points on their surfaces."""

import numpy as np


def ball(count=800, axes=(1.0, 1.0, 1.0), seed=1):
    """An ellipsoid."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None] * axes


def box(count=800, sides=(1.0, 2.0, 3.0), seed=1):
    """A box with its centre at the origin."""
    random = np.random.default_rng(seed)
    points = random.uniform(-0.5, 0.5, size=(count, 3))
    points[np.arange(count), random.integers(0, 3, count)] = random.choice([-0.5, 0.5], count)
    return points * sides


def hammer(count=1200, seed=1):
    """A thing without symmetry: a long box, a short one across its end, and a ball beside that."""
    parts = [box(count // 2, (4.0, 0.5, 0.6), seed), box(count // 4, (0.8, 2.2, 0.9), seed + 1) + (2.0, 0.5, 0.1),
             ball(count // 4, (0.5, 0.5, 0.5), seed + 2) + (-1.8, 0.0, 0.7)]
    return np.concatenate(parts)


def rotation(seed):
    """A random turn."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q
