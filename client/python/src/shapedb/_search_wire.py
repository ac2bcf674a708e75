# SPDX-License-Identifier: Apache-2.0
"""Messages to values and values to messages: searches, comparisons, alignments."""

from __future__ import annotations

from typing import Any, List, Optional, Tuple

import numpy as np

from shapedb.v1 import search_service_pb2 as search_pb

from . import _search_types as types
from ._points import FloatArray, read_only
from ._vectors import vector_of
from ._wire import enum_name, plain, report_of, shape_of, signature_of, unit_of


def matrix_of(motion: Any) -> FloatArray:
    """A `Motion` as a 4 x 4 matrix."""
    matrix = np.eye(4)
    matrix[:3, :3] = motion.scale * np.array(motion.rotation, dtype=np.float64).reshape(3, 3)
    matrix[:3, 3] = vector_of(motion.translation)
    return read_only(matrix)


def pose_of(message: Any) -> types.Pose:
    """Of a `FitPose`."""
    return plain(types.Pose, message, motion=matrix_of(message.motion), scale=message.motion.scale,
                 reflected=message.motion.reflected)


def fit_of(message: Any) -> types.Fit:
    """Of a `Fit`."""
    axes = tuple(types.FreeAxis(read_only(vector_of(axis.point)),
                                read_only(vector_of(axis.direction))) for axis in message.axes)
    return plain(types.Fit, message, best=pose_of(message.best),
                 kind=enum_name(search_pb.FitKind, "FIT_KIND_", message.kind) or "whole",
                 alternatives=tuple(pose_of(pose) for pose in message.alternatives), axes=axes)


def verdict_of(number: int) -> Optional[types.Verdict]:
    """Of a `Verdict`; None if there is none."""
    verdict: Optional[types.Verdict] = enum_name(search_pb.Verdict, "VERDICT_", number)
    return verdict


def why_of(message: Any, name: str, shares: Tuple[float, ...]) -> types.Why:
    """Of a `Hit` or a `CompareResponse`, which have an explanation, a verdict and perhaps a fit."""
    explanation = message.explanation
    fit = fit_of(message.fit) if message.HasField("fit") else None
    return types.Why(
        name=name, verdict=verdict_of(message.verdict), reliability=message.verdict_reliability,
        similarity=explanation.similarity, dissimilarity=explanation.dissimilarity,
        terms=tuple(plain(types.Term, term) for term in explanation.terms),
        matches=tuple(types.SegmentMatch(match.query_segment, match.hit_segment, match.share, match.distance)
                      for match in explanation.matches),
        unmatched_query=tuple(explanation.unmatched_query), unmatched_hit=tuple(explanation.unmatched_hit),
        degenerate=explanation.degenerate, query_shares=shares,
        motion=matrix_of(explanation.motion), scale=explanation.motion.scale,
        reflected=explanation.motion.reflected, fit=fit)


def _hit_of(message: Any, shares: Tuple[float, ...], group: Optional[str]) -> types.Hit:
    why = why_of(message, message.shape.key, shares) if message.HasField("explanation") else None
    fit = fit_of(message.fit) if message.HasField("fit") else None
    motion = fit.motion if fit is not None else why.motion if why is not None else None
    return types.Hit(
        key=message.shape.key, score=message.score, verdict=verdict_of(message.verdict),
        verdict_reliability=message.verdict_reliability, shape=shape_of(message.shape),
        signature_score=message.signature_score, motion=motion, why=why, fit=fit, group=group)


def result_of(message: Any, covered: float) -> types.SearchResult:
    """Of a `SearchResponse`; `covered` as of `SearchResult`."""
    groups = tuple(types.Group(group.value if group.HasField("value") else None, group.hits)
                   for group in message.groups)
    group_of_hit: List[Optional[str]] = [group.value for group in groups for _ in range(group.hits)]
    shares = tuple(point.volume_share for point in message.query.points)
    hits = tuple(_hit_of(hit, shares, group_of_hit[index] if groups else None)
                 for index, hit in enumerate(message.hits))
    return types.SearchResult(
        hits=hits, groups=groups, candidates=message.candidates, filtered=message.filtered, scored=message.scored,
        verified=message.candidates_verified, exact=not message.not_exact, pending=message.pending,
        unit=unit_of(message.unit), left_right_untold=message.left_right_untold,
        covered=covered, query=signature_of(message.query), seconds_segment=message.seconds_segment,
        seconds_search=message.seconds_search,
        report=report_of(message.report) if message.HasField("report") else None)


def comparison_of(message: Any, name: str) -> types.Comparison:
    """Of a `CompareResponse`."""
    shares = tuple(point.volume_share for point in message.query.points)
    why = why_of(message, name, shares)
    return types.Comparison(
        score=message.score, verdict=why.verdict, verdict_reliability=why.reliability,
        signature_score=message.signature_score, motion=why.fit.motion if why.fit is not None else why.motion,
        why=why, fit=why.fit, unit=unit_of(message.unit), left_right_untold=message.left_right_untold,
        query=signature_of(message.query), other=signature_of(message.other))
