# SPDX-License-Identifier: Apache-2.0
"""The examples do what they say."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import shapedb

import solids

EXAMPLES = Path(__file__).resolve().parents[2] / "client/python/examples"


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def tables(seed):
    """Five things of which two are the same."""
    moved = solids.hammer(seed=seed) @ solids.rotation(seed).T * 2.0 + 7.0
    return {"a hammer": solids.hammer(), "box": solids.box(), "egg": solids.ball(axes=(1, 1, 3)),
            "hammer again": moved, "plank": solids.box(sides=(0.3, 1, 4))}


def test_duplicates(client, tmp_path, capsys):
    for key, points in tables(5).items():
        np.save(tmp_path / f"{key}.npy", points)
    arguments = [str(tmp_path), "--server", client.address, "--collection", "doubles"]
    assert example("duplicates").main(arguments) == 0
    printed = capsys.readouterr().out
    assert "a hammer\n  = hammer again  0." in printed and "5 scans, 1 objects with more than one" in printed
    (tmp_path / "bad.npy").write_bytes(b"")
    assert example("duplicates").main(arguments) == 1
    assert "bad: " in capsys.readouterr().err


def test_labels_are_carried_over(client, capsys):
    collection = client.create_collection("labels")
    for key, points in tables(5).items():
        collection.add(key, points, metadata={} if key == "hammer again" else {"label": key.split()[-1]})
    collection.wait_until_ready()
    carry = example("carry_labels")
    assert carry.main([client.address, "labels"]) == 0
    assert "hammer again: hammer (like a hammer, 0." in capsys.readouterr().out
    assert collection.get("hammer again").label is None
    assert carry.main([client.address, "labels", "--write"]) == 0
    metadata = collection.get("hammer again").metadata
    assert metadata["label"] == "hammer" and metadata["label.from"] == "a hammer"
    assert 0.3 < float(metadata["label.score"]) <= 1.0
    assert carry.main([client.address, "labels", "--write"]) == 0
    assert "0 of 0 unlabelled" in capsys.readouterr().out


def test_open3d(capsys):
    pytest.importorskip("open3d", reason="Open3D is not installed (scripts/install-deps.sh --open3d)")
    assert example("open3d_interop").main([]) == 0
    key, rest = capsys.readouterr().out.split(", score ")
    assert key == "table" and float(rest.split(": ")[1].split()[0]) < 0.05


def test_an_open3d_cloud_is_a_scan():
    open3d = pytest.importorskip("open3d", reason="Open3D is not installed (scripts/install-deps.sh --open3d)")
    points = solids.box(100)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    np.testing.assert_array_equal(shapedb.as_points(cloud), points)
    assert shapedb.as_points(open3d.geometry.TriangleMesh.create_box()).shape == (20000, 3)


def test_trimesh(tmp_path, capsys):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed (pip install trimesh)")
    for name, mesh in (("ball.off", trimesh.creation.icosphere()), ("box.off", trimesh.creation.box((1, 2, 3)))):
        mesh.export(tmp_path / name)
    query = trimesh.creation.box((2, 4, 6))
    query.apply_translation((5, 5, 5))
    query.export(tmp_path / "query.ply")
    assert example("trimesh_interop").main([str(tmp_path), str(tmp_path / "query.ply")]) == 0
    assert "box.off" in capsys.readouterr().out and (tmp_path / "query.ply.found.ply").exists()
