# SPDX-License-Identifier: GPL-3.0-or-later
"""A client that is not ours, with scans that lie far from the origin of their coordinates."""

import math
import struct
import unittest

from attacker import Server, admin, align, grpc, main, pack, reason, search, shapes, types

SITE = (4_400_000.25, -5_213_337.5, 120.125)
ELSEWHERE = (691_607.0, 5_335_942.75, 519.5)


def knob(points=4_000):
    """A closed surface about two units across that no turn and no mirror maps to itself."""
    golden = math.pi * (3.0 - math.sqrt(5.0))
    bumps = (((0.9, 0.3, 0.3), 0.55, 8), ((-0.2, 0.9, -0.4), 0.4, 6), ((0.1, -0.5, 0.85), 0.3, 10))
    cloud = []
    for i in range(points):
        z = 1.0 - 2.0 * (i + 0.5) / points
        r = math.sqrt(1.0 - z * z)
        d = (r * math.cos(golden * i), r * math.sin(golden * i), z)
        radius = 0.55
        for axis, height, sharpness in bumps:
            radius += height * max(0.0, sum(a * b for a, b in zip(axis, d))) ** sharpness
        cloud.append(tuple(radius * c for c in d))
    return cloud


def turned(points, angle=0.7):
    """About the axis (1, 1, 1)."""
    c, s = math.cos(angle), math.sin(angle)
    third = (1.0 - c) / 3.0
    a, b, e = c + third, third - s / math.sqrt(3.0), third + s / math.sqrt(3.0)
    rows = ((a, b, e), (e, a, b), (b, e, a))
    return [tuple(sum(m * x for m, x in zip(row, p)) for row in rows) for p in points]


def single(points):
    """What is left of them in single precision."""
    return [struct.unpack("<fff", struct.pack("<fff", *p)) for p in points]


def at(points, place):
    return [tuple(x + o for x, o in zip(p, place)) for p in points]


def vector(place):
    return types.Vector3(x=place[0], y=place[1], z=place[2])


def triple(message):
    return (message.x, message.y, message.z)


def moved(motion, p):
    r, t = motion.rotation, triple(motion.translation)
    return tuple(motion.scale * sum(r[3 * i + j] * p[j] for j in range(3)) + t[i] for i in range(3))


def farthest(a, b):
    return max(math.dist(p, q) for p, q in zip(a, b))


class Origins(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server()
        cls.client = cls.server.connect()
        cls.points = single(knob())
        cls.turned = single(turned(cls.points))
        cls.add("near", cls.points)
        cls.add("far", cls.points, SITE)

    @classmethod
    def tearDownClass(cls):
        cls.client.__exit__()
        cls.server.__exit__()

    @classmethod
    def add(cls, key, points, origin=None, **header):
        if origin is not None:
            header["origin"] = vector(origin)
        return cls.client.add(key, points, **header)

    def ref(self, key):
        return shapes.ShapeRef(key=key)

    def search(self, points, origin=None, **options):
        header = search.SearchByScanHeader(options=search.SearchOptions(k=5, **options), point_count=len(points))
        if origin is not None:
            header.origin.CopyFrom(vector(origin))
        return self.client.search.SearchByScan(iter((
            search.SearchByScanRequest(header=header),
            search.SearchByScanRequest(chunk=types.PointChunk(xyz=pack(points))))), timeout=60)

    def segment(self, points, origin=None):
        header = shapes.SegmentHeader(point_count=len(points))
        if origin is not None:
            header.origin.CopyFrom(vector(origin))
        return list(self.client.shapes.Segment(iter((
            shapes.SegmentRequest(header=header),
            shapes.SegmentRequest(chunk=types.PointChunk(xyz=pack(points))))), timeout=60))

    def align(self, query, other=(), **header):
        header = align.AlignHeader(query_points=len(query), **header)
        messages = [align.AlignRequest(header=header), align.AlignRequest(chunk=types.PointChunk(xyz=pack(query)))]
        if other:
            header.other_points = len(other)
            messages[0].header.CopyFrom(header)
            messages.append(align.AlignRequest(chunk=types.PointChunk(xyz=pack(other))))
        return self.client.align.Align(iter(messages), timeout=60).fit

    def assert_refused(self, call, *words, code="coordinate_out_of_range"):
        with self.assertRaises(grpc.RpcError) as failure:
            call()
        self.assertEqual(failure.exception.code(), grpc.StatusCode.INVALID_ARGUMENT, failure.exception)
        self.assertEqual(reason(failure.exception), code)
        for word in words:
            self.assertIn(word, failure.exception.details())

    def assert_same_place(self, motion, hit_points, hit_place, query_points, query_place, tolerance):
        """That `motion` takes the hit where its client has it to the query where its client has it."""
        where = [moved(motion, p) for p in at(hit_points, hit_place)]
        self.assertLess(farthest(where, at(query_points, query_place)), tolerance)

    def test_a_far_scan_is_found_and_its_motion_is_that_of_the_full_coordinates(self):
        near = self.search(self.turned)
        far = self.search(self.turned, ELSEWHERE)
        self.assertEqual([(hit.shape.key, hit.score, hit.fit.misfit) for hit in near.hits],
                         [(hit.shape.key, hit.score, hit.fit.misfit) for hit in far.hits], "nothing else changes")
        places = {"near": (0.0, 0.0, 0.0), "far": SITE}
        self.assertEqual({hit.shape.key for hit in far.hits}, set(places))
        for base, hit in zip(near.hits, far.hits):
            place = places[hit.shape.key]
            self.assertEqual(hit.verdict, search.VERDICT_SAME_OBJECT)
            for motion, relative in ((hit.fit.best.motion, base.fit.best.motion),
                                     (hit.explanation.motion, base.explanation.motion)):
                self.assertFalse(motion.reflected)
                self.assertEqual(motion.scale, relative.scale)
                self.assertEqual(list(motion.rotation), list(relative.rotation))
                # Of the object, which is 2 across, the fit is good to two per cent,
                self.assert_same_place(motion, self.points, place, self.turned, ELSEWHERE, 0.04)
                # and of the fit at the origin nothing is lost.
                if hit.shape.key == "near":
                    where = at([moved(relative, p) for p in self.points], ELSEWHERE)
                    self.assert_same_place(motion, self.points, place, where, (0, 0, 0), 2e-8)
        weighted = [triple(point.position) for point in far.query.points]
        self.assertLess(farthest(weighted, at([triple(p.position) for p in near.query.points], ELSEWHERE)), 2e-9)

    def test_a_motion_loses_nothing_to_cancellation(self):
        far = self.search(self.turned, ELSEWHERE)
        motions = {hit.shape.key: hit.fit.best.motion for hit in far.hits}
        near, away = motions["near"], motions["far"]
        where = [moved(near, p) for p in self.points]
        self.assertLess(farthest([moved(away, p) for p in at(self.points, SITE)], where), 2e-8)

    def test_points_come_back_as_they_were_sent(self):
        shape = self.client.shapes.GetShape(shapes.GetShapeRequest(shape=self.ref("far"))).shape
        self.assertEqual(triple(shape.origin), SITE)
        self.assertFalse(self.client.shapes.GetShape(shapes.GetShapeRequest(shape=self.ref("near")))
                         .shape.HasField("origin"))
        first, *chunks = self.client.shapes.GetPoints(shapes.GetPointsRequest(shape=self.ref("far")))
        self.assertEqual(triple(first.shape.origin), SITE)
        self.assertEqual(b"".join(message.chunk.xyz for message in chunks), pack(self.points))
        listed = self.client.shapes.ListShapes(shapes.ListShapesRequest()).shapes
        self.assertEqual({one.key: triple(one.origin) for one in listed if one.key in ("near", "far")},
                         {"near": (0.0, 0.0, 0.0), "far": SITE})

    def test_segments_come_with_their_origin(self):
        for summary, *chunks in (
                self.segment(self.points, SITE),
                list(self.client.shapes.GetSegments(shapes.GetSegmentsRequest(shape=self.ref("far"))))):
            self.assertEqual(triple(summary.summary.origin), SITE)
            self.assertEqual(b"".join(message.chunk.xyz for message in chunks), pack(self.points))
            for point in summary.summary.signature.points:
                self.assertLess(math.dist(triple(point.position), SITE), 2.0)
        summary, *_ = self.segment(self.points)
        self.assertFalse(summary.summary.HasField("origin"))

    def test_a_signature_has_its_place(self):
        def signature(key):
            return self.client.shapes.GetSignature(shapes.GetSignatureRequest(shape=self.ref(key))).signature

        near, far = signature("near"), signature("far")
        self.assertLess(farthest([triple(p.position) for p in far.points],
                                 at([triple(p.position) for p in near.points], SITE)), 2e-9)
        self.assertEqual([(p.weight, p.volume_share, list(p.extents)) for p in near.points],
                         [(p.weight, p.volume_share, list(p.extents)) for p in far.points])
        found = self.client.search.SearchBySignature(search.SearchBySignatureRequest(
            options=search.SearchOptions(k=2), signature=far.encoded))
        self.assertEqual([hit.score for hit in found.hits], [1.0, 1.0])
        for hit in found.hits:
            place = SITE if hit.shape.key == "far" else (0, 0, 0)
            self.assert_same_place(hit.explanation.motion, self.points, place, self.points, SITE, 1e-3)

    def test_stored_queries_have_their_place(self):
        options = search.SearchOptions(k=2)
        single_search = self.client.search.SearchByKey(search.SearchByKeyRequest(options=options, key="far"))
        batch = self.client.search.SearchBatch(search.SearchBatchRequest(
            options=options, queries=[search.SearchBatchRequest.Query(key="far")]))
        for found in (single_search, batch.responses[0]):
            hit = next(hit for hit in found.hits if hit.shape.key == "near")
            for motion in (hit.fit.best.motion, hit.explanation.motion):
                self.assert_same_place(motion, self.points, (0, 0, 0), self.points, SITE, 0.01)

    def test_compare_and_align(self):
        compared = self.client.search.Compare(search.CompareRequest(query=self.ref("far"), other=self.ref("near")))
        self.assertEqual(compared.score, 1.0)
        self.assert_same_place(compared.fit.best.motion, self.points, (0, 0, 0), self.points, SITE, 0.01)
        self.assert_same_place(compared.explanation.motion, self.points, (0, 0, 0), self.points, SITE, 0.01)
        for fit in (self.align(self.turned, key=self.ref("far"), query_origin=vector(ELSEWHERE)),
                    self.align(self.turned, self.points, query_origin=vector(ELSEWHERE), other_origin=vector(SITE))):
            self.assert_same_place(fit.best.motion, self.points, SITE, self.turned, ELSEWHERE, 0.04)
        # One with free axes.
        ball = single([(0.5 * x / math.hypot(x, y, z), 0.5 * y / math.hypot(x, y, z), 0.5 * z / math.hypot(x, y, z))
                       for x, y, z in self.points])
        fit = self.align(ball, ball, query_origin=vector(ELSEWHERE), other_origin=vector(SITE))
        self.assertEqual(len(fit.axes), 3)
        for axis in fit.axes:
            self.assertLess(math.dist(triple(axis.point), ELSEWHERE), 0.1)

    def test_a_viewpoint_is_in_the_coordinates_of_the_query(self):
        one_side = [p for p in self.points if p[2] > 0.1]
        camera = (0.0, 0.0, 9.0)
        near = self.search(one_side, viewpoint=vector(camera))
        far = self.search(one_side, ELSEWHERE, viewpoint=vector(at([camera], ELSEWHERE)[0]))
        self.assertEqual([(hit.shape.key, hit.score) for hit in near.hits],
                         [(hit.shape.key, hit.score) for hit in far.hits])

    def test_points_too_coarse_are_refused_with_a_remedy(self):
        rounded = single(at(self.points, SITE))
        remedy = "field origin of the header"
        self.assert_refused(lambda: self.add("lost", rounded), "0.5 apart in single precision", "across", remedy)
        self.assert_refused(lambda: self.search(rounded), remedy)
        self.assert_refused(lambda: self.segment(rounded), remedy)
        self.assert_refused(lambda: self.align(rounded, self.points), "query: ", remedy)
        self.assert_refused(lambda: self.align(self.points, rounded), "other: ", remedy)
        self.assert_refused(lambda: self.add("lost", rounded, SITE), remedy)
        with self.assertRaises(grpc.RpcError) as failure:
            self.client.shapes.GetShape(shapes.GetShapeRequest(shape=self.ref("lost")))
        self.assertEqual(failure.exception.code(), grpc.StatusCode.NOT_FOUND)

    def test_outliers_do_not_hide_that_a_scan_is_lost(self):
        remedy = "field origin of the header"
        for outliers in ([(0, 0, 0)], [(0, 0, 0)] * 5, [(1e7, 1e7, 0), (0, 0, 0), (0, 1e7, 1e7), (1e7, 0, 1e7)]):
            for size in (0.02, 1.0, 40.0):
                lost = single(at([tuple(size * c for c in p) for p in self.points], SITE))
                self.assert_refused(lambda: self.add("lost", outliers + lost), remedy)
                self.assert_refused(lambda: self.add("lost", lost + outliers), remedy)

    def test_origins_have_limits(self):
        points = self.points
        for bad, code, words in (
                ((math.nan, 0, 0), "non_finite_coordinate", "origin: x is NaN"),
                ((0, math.inf, 0), "non_finite_coordinate", "origin: y is infinite"),
                ((0, 0, -3.5e38), "coordinate_out_of_range", "origin: z exceeds the largest magnitude 3.4e38"),
                ((0, 0, 1e300), "coordinate_out_of_range", "origin: z exceeds"),
                ((3e10, 0, 0), "coordinate_out_of_range", "in double precision"),
                ((3.4e38, 0, 0), "coordinate_out_of_range", "in double precision")):
            self.assert_refused(lambda: self.add("bad", points, bad), words, code=code)
            self.assert_refused(lambda: self.search(points, bad), words, code=code)
            self.assert_refused(lambda: self.segment(points, bad), words, code=code)
            self.assert_refused(lambda: self.align(points, points, query_origin=vector(bad)), "query: ", words, code=code)
            self.assert_refused(lambda: self.align(points, points, other_origin=vector(bad)), "other: ", words, code=code)
        # A millionth of two units is what double precision holds up to here.
        self.assertEqual(triple(self.add("limit", points, (1.5e10, 0, 0)).shape.origin), (1.5e10, 0, 0))
        large = [tuple(3e38 * c for c in p) for p in points]
        self.assert_refused(lambda: self.add("bad", large, (3.4e38, 0, 0)), "beyond 3.4e38")

    def test_another_origin_is_another_scan(self):
        created = self.add("again", self.points, SITE)
        outcome = shapes.AddShapeResponse
        self.assertEqual(created.outcome, outcome.OUTCOME_CREATED)
        self.assertEqual(self.add("again", self.points, SITE).outcome, outcome.OUTCOME_UNCHANGED)
        with self.assertRaises(grpc.RpcError) as failure:
            self.add("again", self.points, ELSEWHERE, mode=shapes.ADD_MODE_SAME_POINTS)
        self.assertEqual(reason(failure.exception), "already_exists")
        replaced = self.add("again", self.points, ELSEWHERE)
        self.assertEqual(replaced.outcome, outcome.OUTCOME_REPLACED)
        self.assertEqual(triple(replaced.shape.origin), ELSEWHERE)
        self.assertEqual(replaced.shape.sha256, created.shape.sha256, "of what was sent")
        hits = {hit.shape.key: hit for hit in self.search(self.points).hits}
        self.assert_same_place(hits["again"].fit.best.motion, self.points, ELSEWHERE, self.points, (0, 0, 0), 0.02)
        back = self.add("again", self.points)
        self.assertEqual(back.outcome, outcome.OUTCOME_REPLACED)
        self.assertFalse(back.shape.HasField("origin"))

    def test_isolation_keeps_the_origin(self):
        plane = [(0.1 * i - 2.0, 0.1 * j - 2.0, -1.0) for i in range(41) for j in range(41)]
        scene = types.Isolation(drop_plane=True, largest_object=True)
        added = self.add("isolated", self.points + single(plane), SITE, isolation=scene)
        self.assertLess(added.shape.point_count, len(self.points) + len(plane))
        self.assertEqual(triple(added.shape.origin), SITE)


class Restarts(unittest.TestCase):
    def test_and_rebuilds_keep_origins(self):
        with Server() as server:
            points = single(knob(2_000))
            with server.connect() as client:
                client.add("far", points, origin=vector(SITE))
            server.stop()
            server.start()
            with server.connect() as client:
                shape = client.shapes.GetShape(shapes.GetShapeRequest(shape=shapes.ShapeRef(key="far"))).shape
                self.assertEqual(triple(shape.origin), SITE)
                again = client.add("far", points, origin=vector(SITE))
                self.assertEqual(again.outcome, shapes.AddShapeResponse.OUTCOME_UNCHANGED)
                *_, last = client.admin.Rebuild(admin.RebuildRequest(collection="default"), timeout=60)
                self.assertTrue(last.finished)
                signature = client.shapes.GetSignature(shapes.GetSignatureRequest(
                    shape=shapes.ShapeRef(key="far"))).signature
                for point in signature.points:
                    self.assertLess(math.dist(triple(point.position), SITE), 2.0)


if __name__ == "__main__":
    main()
