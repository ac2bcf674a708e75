# SPDX-License-Identifier: Apache-2.0
"""Scans from Open3D and back: finds a mesh by a noisy part of its points, and lays it on them.

    open3d_interop.py               prints how far apart they are
    open3d_interop.py --show        and opens a window

Needs Open3D (Debian: python3-open3d). Its clouds and meshes are scans as they are; `hit.motion` is what
`transform` takes.
"""

from __future__ import annotations

import argparse
import sys
from typing import Optional, Sequence

import numpy as np
import open3d as o3d
import shapedb


def models() -> "dict[str, o3d.geometry.TriangleMesh]":
    """What is searched: a mug, a table and a screw, more or less."""
    handle = o3d.geometry.TriangleMesh.create_torus(0.6, 0.15)
    handle.rotate(handle.get_rotation_matrix_from_xyz((np.pi / 2, 0, 0))).translate((1.3, 0, 0))
    mug = o3d.geometry.TriangleMesh.create_cylinder(1.0, 2.0) + handle
    table = o3d.geometry.TriangleMesh.create_box(3.0, 2.0, 0.2)
    for x, y in ((0.1, 0.1), (2.7, 0.1), (0.1, 1.7), (2.7, 1.7)):
        table += o3d.geometry.TriangleMesh.create_box(0.2, 0.2, 1.5).translate((x, y, -1.5))
    screw = o3d.geometry.TriangleMesh.create_cylinder(0.2, 2.0) + \
        o3d.geometry.TriangleMesh.create_cylinder(0.5, 0.3).translate((0, 0, 1.0))
    return {"mug": mug, "table": table, "screw": screw}


def scan_of(mesh: "o3d.geometry.TriangleMesh") -> "o3d.geometry.PointCloud":
    """A noisy scan from somewhere else."""
    o3d.utility.random.seed(1)
    cloud = mesh.sample_points_uniformly(3000)
    points = np.asarray(cloud.points)
    points += np.random.default_rng(1).normal(scale=0.005, size=points.shape)
    turn = cloud.get_rotation_matrix_from_xyz((0.4, 1.1, -0.7))
    return cloud.rotate(turn).translate((5.0, 1.0, -2.0))


def main(arguments: Optional[Sequence[str]] = None) -> int:
    parser = argparse.ArgumentParser(description="Finds Open3D meshes by scans of them.")
    parser.add_argument("--show", action="store_true", help="open a window")
    options = parser.parse_args(arguments)
    with shapedb.local() as client:
        collection = client.create_collection("models")
        meshes = models()
        for key, mesh in meshes.items():
            collection.add(key, mesh, wait=True)  # sampled: its triangles are large
        query = scan_of(meshes["table"])
        hit = collection.search(query, k=1)[0]
        assert hit.motion is not None
        found = o3d.geometry.TriangleMesh(meshes[hit.key]).transform(hit.motion)
        apart = np.asarray(query.compute_point_cloud_distance(found.sample_points_uniformly(20000)))
        print(f"{hit.key}, score {hit.score:.3f}: {apart.mean():.3f} apart on average, {hit.verdict}")
        if options.show:
            o3d.visualization.draw_geometries([query.paint_uniform_color((0.1, 0.4, 0.7)),
                                               found.paint_uniform_color((1.0, 0.5, 0.1))])
    return 0


if __name__ == "__main__":
    sys.exit(main())
