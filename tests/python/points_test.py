# SPDX-License-Identifier: Apache-2.0
"""What is taken for a scan, and how it is packed."""

import pickle
import types

import hypothesis.extra.numpy as arrays
import hypothesis.strategies as st
import numpy as np
import pytest
import shapedb
from hypothesis import given
from shapedb._points import CHUNK_BYTES, pack, unpack

import solids

finite = st.floats(-1e6, 1e6, width=32)


def refusal(scan):
    with pytest.raises(shapedb.InvalidInput) as error:
        shapedb.as_points(scan)
    assert isinstance(error.value, ValueError)
    return error.value


@given(arrays.arrays(np.float32, st.tuples(st.integers(1, 50), st.just(3)), elements=finite))
def test_points_come_back_as_they_were_packed(points):
    packed = pack(points)
    assert packed.count == len(points) and len(packed.data) == 12 * len(points)
    back = unpack(packed.data, packed.origin)
    size = np.ptp(points.astype(np.float64), axis=0).max()
    np.testing.assert_allclose(back, points, rtol=0, atol=1e-5 * size)


@given(arrays.arrays(np.float64, (20, 3), elements=st.floats(-1, 1)), st.floats(1e3, 1e8))
def test_far_from_the_origin_the_shape_is_kept(points, distance):
    points[0], points[1] = (-1, -1, -1), (1, 1, 1)
    far = points + distance
    packed = pack(far)
    assert packed.origin.any()
    np.testing.assert_allclose(unpack(packed.data, packed.origin), far, rtol=0, atol=3e-6)


@pytest.mark.parametrize("outliers", [[(0, 0, 0)], [(0, 0, 0), (1e7, 0, 0), (-1e30, 0, 0)]])
def test_outliers_do_not_choose_the_origin(outliers):
    far = solids.ball() + (4.5e6, -5.4e6, 300.0)
    packed = pack(np.vstack([outliers, far]))
    assert np.abs(packed.origin - (4.5e6, -5.4e6, 300.0)).max() < 2.0
    np.testing.assert_allclose(unpack(packed.data, packed.origin)[len(outliers):], far, rtol=0, atol=3e-6)
    assert not pack(np.vstack([outliers, solids.ball()])).origin.any()
    with pytest.raises(shapedb.InvalidInput, match="too far from most others"):
        pack(np.vstack([[(-3e38, 0, 0)], 1e30 * solids.ball() + (3e38, 0, 0)]))


def test_near_the_origin_nothing_is_subtracted():
    packed = pack(solids.ball())
    assert not packed.origin.any()
    np.testing.assert_array_equal(unpack(packed.data, packed.origin), solids.ball().astype(np.float32))


def test_integers_lists_and_other_strides_are_arrays_too():
    grid = np.arange(24).reshape(8, 3)
    for scan in (grid, grid.tolist(), np.asfortranarray(grid.astype(np.float32)), grid[::-1][::-1],
                 grid.astype(">f8")):
        np.testing.assert_array_equal(shapedb.as_points(scan), grid)
        np.testing.assert_array_equal(unpack(pack(scan).data, pack(scan).origin), grid)


def test_objects_with_points_or_vertices():
    points = solids.ball(50)
    cloud = types.SimpleNamespace(points=[tuple(point) for point in points])
    np.testing.assert_array_equal(shapedb.as_points(cloud), points)
    np.testing.assert_array_equal(shapedb.as_points(types.SimpleNamespace(vertices=points)), points)
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    for name in ("faces", "triangles"):
        mesh = types.SimpleNamespace(vertices=square, **{name: [(0, 1, 2), (0, 2, 3)]})
        samples = shapedb.as_points(mesh)
        assert samples.shape == (20000, 3) and (samples[:, 2] == 0).all()
        assert abs(samples[:, 0].mean() - 0.5) < 0.01
        np.testing.assert_array_equal(samples, shapedb.as_points(mesh))


@pytest.mark.parametrize("scan, reason, words", [
    (np.zeros((0, 3)), "too_few_points", "no points"),
    ([], "too_few_points", "no points"),
    (np.zeros((3, 10)), "invalid_argument", "(3, 10); it must be (n, 3); its transpose"),
    (np.zeros(9), "invalid_argument", "(9,)"),
    (np.zeros((4, 3), dtype=complex), "invalid_argument", "complex"),
    (np.zeros((4, 3), dtype=bool), "invalid_argument", "bool"),
    ([[1, 2, 3], [4, 5]], "invalid_argument", ""),
    (None, "invalid_argument", "NoneType"),
    (object(), "invalid_argument", "object"),
    ([(0, 0, 0), (1, float("nan"), 2)], "non_finite_coordinate", "point 1 is (1, nan, 2)"),
    ([(0, 0, 0), (1, 0, float("inf"))], "non_finite_coordinate", "point 1"),
    ([(0, 0, 0), (1e39, 0, 0)], "coordinate_out_of_range", "point 1 is (1e+39, 0, 0)"),
])
def test_what_is_no_scan_is_refused_by_name(scan, reason, words):
    error = refusal(scan)
    assert error.reason == reason and words in error.message


def test_a_scan_too_small_for_single_precision():
    with pytest.raises(shapedb.InvalidInput, match="too small for single precision"):
        pack(solids.ball() * 1e-33)


def test_chunks_hold_whole_points():
    packed = pack(np.random.default_rng(1).normal(size=(200_000, 3)))
    chunks = list(packed.chunks())
    assert b"".join(chunks) == packed.data and len(chunks) == 3
    assert all(len(chunk) % 12 == 0 and len(chunk) <= CHUNK_BYTES <= 1 << 20 for chunk in chunks)


def test_errors_travel_between_processes():
    for error in (shapedb.ShapeDBError("not_found", "none"), shapedb.InvalidInput("too_few_points", "none")):
        copy = pickle.loads(pickle.dumps(error))
        assert type(copy) is type(error) and (copy.reason, copy.message) == (error.reason, error.message)


def test_transform_is_the_matrix_product():
    motion = np.eye(4)
    motion[:3, :3] = 2 * solids.rotation(1)
    motion[:3, 3] = (1, 2, 3)
    points = solids.box(20)
    homogeneous = np.column_stack([points, np.ones(20)])
    np.testing.assert_allclose(shapedb.transform(points, motion), (homogeneous @ motion.T)[:, :3])
    with pytest.raises(shapedb.InvalidInput, match=r"\(3, 3\)"):
        shapedb.transform(points, np.eye(3))
