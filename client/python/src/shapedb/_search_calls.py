# SPDX-License-Identifier: Apache-2.0
"""The calls that search, compare and align, as values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from shapedb.v1 import align_service_pb2 as align_pb
from shapedb.v1 import search_service_pb2 as pb

from . import _search_types as types
from ._call import Call
from ._errors import InvalidInput
from ._points import Packed, text_of
from ._progress import Showing
from ._search_wire import comparison_of, fit_of, result_of
from ._shape_calls import fill_isolation, fill_scan, upload
from ._types import Signature
from ._vectors import fill_vector, send_origin

BATCH = 25
"""Queries in one call: it must be done in the time of one, and its answer fit into a message."""


@dataclass(frozen=True)
class Options:
    """How to search. `Collection.search` explains each."""

    k: int
    threshold: float
    filter: str
    reflection: bool
    keep_scale: bool
    free_scale: bool
    partial: bool
    explain: bool
    verify: Optional[bool]
    candidates: int
    one_sided: Optional[bool]
    viewpoint: Optional[npt.ArrayLike]
    group_by: Optional[str]
    per_group: int
    at_least: int
    allow_partial: bool

    def message(self, collection: str) -> pb.SearchOptions:
        """As it is sent."""
        filter, group_by = text_of(self.filter, "filter"), text_of(self.group_by or "", "group_by")
        try:
            message = pb.SearchOptions(
                collection=collection, k=self.k, threshold=self.threshold, filter=filter,
                forbid_reflection=not self.reflection, keep_scale=self.keep_scale, free_scale=self.free_scale,
                partial=self.partial, no_explanation=not self.explain, verify_candidates=self.candidates,
                group_by=group_by, per_group=self.per_group, at_least=self.at_least,
                allow_partial=self.allow_partial)
        except (TypeError, ValueError) as error:
            raise InvalidInput("invalid_argument", f"a search option is not of its type or range: {error}") from None
        if self.verify is not None:
            message.verify = self.verify
        if self.one_sided is not None:
            message.one_sided = self.one_sided
        if self.viewpoint is not None:
            place = np.asarray(self.viewpoint, dtype=np.float64)
            if place.shape != (3,) or not np.isfinite(place).all():
                raise InvalidInput("invalid_argument", f"viewpoint is {self.viewpoint!r}; it must be three numbers")
            fill_vector(message.viewpoint, place)
        return message

    def result(self, message: Any) -> types.SearchResult:
        """Of a `SearchResponse` to such a search. A server from before `covered` says 0 and has searched everything."""
        whole = not self.allow_partial or (message.covered == 0.0 and message.candidates > 0)
        return result_of(message, 1.0 if whole else message.covered)


def by_scan(collection: str, options: Options, scan: Packed, drop_plane: bool, largest_object: bool,
            progress: Showing) -> Call[types.SearchResult]:
    """SearchByScan."""
    header = pb.SearchByScanHeader(options=options.message(collection))
    fill_scan(header, scan)
    fill_isolation(header.isolation, drop_plane, largest_object)
    return Call("SearchService/SearchByScan", upload(pb.SearchByScanRequest, header, [scan], progress),
                options.result)


def by_key(collection: str, options: Options, key: str, include_self: bool) -> Call[types.SearchResult]:
    """SearchByKey."""
    request = pb.SearchByKeyRequest(options=options.message(collection), key=text_of(key, "key"),
                                    include_self=include_self)
    return Call("SearchService/SearchByKey", request, options.result)


def by_signature(collection: str, options: Options, signature: Signature) -> Call[types.SearchResult]:
    """SearchBySignature."""
    return Call("SearchService/SearchBySignature",
                pb.SearchBySignatureRequest(options=options.message(collection), signature=signature.encoded),
                options.result)


def batch(collection: str, options: Options,
          queries: Sequence[Union[str, Signature]]) -> Call[Tuple[types.SearchResult, ...]]:
    """SearchBatch."""
    request = pb.SearchBatchRequest(options=options.message(collection))
    for query in queries:
        if isinstance(query, Signature):
            request.queries.add(signature=query.encoded)
        elif isinstance(query, str):
            request.queries.add(key=text_of(query, "key"))
        else:
            raise InvalidInput("invalid_argument",
                               f"a query of a batch is a key or a signature, not a {type(query).__name__}")
    return Call("SearchService/SearchBatch", request, lambda message: tuple(map(options.result, message.responses)))


def query_batches(queries: Sequence[Union[str, Signature]]) -> List[Sequence[Union[str, Signature]]]:
    """Queries in pieces for one call each."""
    if isinstance(queries, str):
        raise InvalidInput("invalid_argument", "queries is a text; give a list of keys or signatures")
    return [queries[at:at + BATCH] for at in range(0, len(queries), BATCH)]


@dataclass(frozen=True)
class CompareOptions:
    """How to compare and to align."""

    reflection: bool
    keep_scale: bool
    free_scale: bool
    partial: bool

    def fill(self, message: Any) -> None:
        """Into a request."""
        message.forbid_reflection = not self.reflection
        message.keep_scale = self.keep_scale
        message.free_scale = self.free_scale
        message.partial = self.partial


def compare(query: Tuple[str, str], other: Tuple[str, str], options: CompareOptions) -> Call[types.Comparison]:
    """Compare; shapes are (collection, key)."""
    request = pb.CompareRequest()
    request.query.collection, request.query.key = query[0], text_of(query[1], "key")
    request.other.collection, request.other.key = text_of(other[0], "other_collection"), text_of(other[1], "key")
    options.fill(request)
    return Call("SearchService/Compare", request, lambda message: comparison_of(message, other[1]))


def align(query: Packed, other: Union[Packed, Tuple[str, str]], options: CompareOptions, drop_plane: bool,
          largest_object: bool, progress: Showing) -> Call[types.Fit]:
    """Align: a scan, and another or a stored shape (collection, key)."""
    header = align_pb.AlignHeader(query_points=query.count, query_sha256=query.sha256)
    options.fill(header)
    fill_isolation(header.query_isolation, drop_plane, largest_object)
    send_origin(header, query.origin, "query_origin")
    scans = [query]
    if isinstance(other, Packed):
        header.other_points, header.other_sha256 = other.count, other.sha256
        fill_isolation(header.other_isolation, drop_plane, largest_object)
        send_origin(header, other.origin, "other_origin")
        scans.append(other)
    else:
        header.key.collection, header.key.key = other[0], text_of(other[1], "key")
    return Call("AlignService/Align", upload(align_pb.AlignRequest, header, scans, progress),
                lambda message: fit_of(message.fit))
