# SPDX-License-Identifier: Apache-2.0
"""The calls about scans and shapes, as values."""

from __future__ import annotations

import hashlib
from typing import Any, Callable, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from shapedb.v1 import shape_service_pb2 as pb

from . import _types as types
from ._call import Call, Collector, Last
from ._errors import InvalidInput, ShapeDBError
from ._points import FloatArray, Packed, read_only, text_of, unpack
from ._progress import Showing, reporter
from ._vectors import send_origin, vector_of
from ._wire import (added_of, answered_shape_of, enum_number, event_of, fill_metadata_change, fill_parameters,
                    metadata_texts, metadata_update_of, report_of, shape_of, signature_of, state_number,
                    value_counts_of)


def upload(request: Any, header: Any, scans: Sequence[Packed],
           progress: Showing) -> Callable[[], Iterator[Any]]:
    """Makes the messages of an upload: a header, then the chunks of each scan. `request` is their class."""
    def messages() -> Iterator[Any]:
        yield request(header=header)
        report = reporter(progress, "upload")
        total = sum(len(scan.data) for scan in scans)
        sent = 0
        for chunk in (chunk for scan in scans for chunk in scan.chunks()):
            message = request()
            message.chunk.xyz = chunk
            yield message
            sent += len(chunk)
            report(sent, total)

    return messages


def fill_isolation(isolation: Any, drop_plane: bool, largest_object: bool) -> None:
    """Into an `Isolation`."""
    if drop_plane or largest_object:
        isolation.drop_plane = drop_plane
        isolation.largest_object = largest_object


def fill_scan(header: Any, scan: Packed) -> None:
    """Count, checksum and origin, into the header of one scan."""
    header.point_count = scan.count
    header.sha256 = scan.sha256
    send_origin(header, scan.origin)


def add(collection: str, key: str, scan: Packed, *, metadata: Optional[types.Metadata], mode: types.AddMode,
        expected_version: Optional[int], wait: bool, drop_plane: bool, largest_object: bool,
        progress: Showing) -> Call[types.Added]:
    """AddShape. The same key with the same points is the same shape, so it is repeated; not if it depends on the
    version, which a first try whose reply was lost may have changed."""
    header = pb.AddShapeHeader(collection=collection, key=text_of(key, "key"), wait=wait)
    header.mode = enum_number(pb.AddMode, "ADD_MODE_", mode, "mode")  # type: ignore[assignment]
    if expected_version is not None:
        header.expected_version = expected_version
    fill_scan(header, scan)
    if metadata is not None:
        header.metadata_change.replace_all = True
        header.metadata_change.set.update(metadata_texts(metadata))
    else:
        header.metadata_change.SetInParent()  # a shape that has the key keeps its metadata
    fill_isolation(header.isolation, drop_plane, largest_object)
    return Call("ShapeService/AddShape", upload(pb.AddShapeRequest, header, [scan], progress), added_of,
                idempotent=expected_version is None, bounded=not wait)


def get(collection: str, key: str) -> Call[types.Shape]:
    """GetShape."""
    return Call("ShapeService/GetShape", pb.GetShapeRequest(shape=_ref(collection, key)), answered_shape_of)


def _keys(keys: Sequence[str]) -> List[str]:
    if isinstance(keys, str):
        raise InvalidInput("invalid_argument", "keys is a text; give a list of keys")
    return [text_of(key, "key") for key in keys]


def _ref(collection: str, key: str) -> pb.ShapeRef:
    return pb.ShapeRef(collection=collection, key=text_of(key, "key"))


def get_messages(collection: str, keys: Sequence[str]) -> Call[Any]:
    """GetShapes, answered with the message itself."""
    return Call("ShapeService/GetShapes", pb.GetShapesRequest(collection=collection, keys=_keys(keys)),
                lambda message: message)


def get_many(collection: str, keys: Sequence[str]) -> Call[types.Found]:
    """GetShapes."""
    return Call("ShapeService/GetShapes", pb.GetShapesRequest(collection=collection, keys=_keys(keys)),
                lambda message: types.Found(tuple(map(shape_of, message.shapes)), tuple(message.missing)))


class _Points(Collector[FloatArray]):
    def __init__(self) -> None:
        self._shape: Any = None
        self._chunks: List[bytes] = []

    def take(self, message: Any) -> None:
        if message.HasField("shape"):
            self._shape = message.shape
        else:
            self._chunks.append(message.chunk.xyz)

    def result(self) -> FloatArray:
        data = b"".join(self._chunks)
        if self._shape is None or len(data) != 12 * self._shape.point_count:
            count = 0 if self._shape is None else self._shape.point_count
            raise ShapeDBError("count_mismatch", f"the server sent {len(data)} bytes for {count} points")
        if hashlib.sha256(data).digest() != self._shape.sha256:
            raise ShapeDBError("checksum_mismatch",
                               f"the points of '{self._shape.key}' were damaged in transfer: ask for them again")
        return unpack(data, vector_of(self._shape.origin))


def points(collection: str, key: str) -> Call[FloatArray]:
    """GetPoints."""
    return Call("ShapeService/GetPoints", pb.GetPointsRequest(shape=_ref(collection, key)), collect=_Points)


def previews(collection: str, keys: Sequence[str], max_points: int) -> Call[Tuple[types.Preview, ...]]:
    """GetPreviews."""
    request = pb.GetPreviewsRequest(collection=collection, keys=_keys(keys))
    try:
        request.max_points = max_points
    except (TypeError, ValueError):
        raise InvalidInput("invalid_argument", f"max_points is {max_points!r}; it must be a whole number, at least "
                           "0") from None
    return Call("ShapeService/GetPreviews", request, lambda message: tuple(map(_preview_of, message.previews)))


def _preview_of(message: Any) -> types.Preview:
    normals = np.frombuffer(message.normals, dtype=np.int8).reshape(-1, 3).astype(np.float64) / 127.0
    return types.Preview(message.key, message.version, read_only(unpack(message.xyz, np.zeros(3))), read_only(normals))


def page(collection: str, *, filter: str, state: Optional[types.State], order: types.Order, descending: bool,
         key_prefix: str, page_size: int, cursor: str) -> Call[types.Page]:
    """ListShapes."""
    request = pb.ListShapesRequest(collection=collection, filter=text_of(filter, "filter"), state=state_number(state),
                                   page_size=page_size, cursor=text_of(cursor, "cursor"), descending=descending,
                                   key_prefix=text_of(key_prefix, "key_prefix"))
    request.order = enum_number(pb.ShapeOrder, "SHAPE_ORDER_", order, "order")  # type: ignore[assignment]
    return Call("ShapeService/ListShapes", request,
                lambda message: types.Page(tuple(map(shape_of, message.shapes)), message.next_cursor))


def count(collection: str, filter: str, state: Optional[types.State], key_prefix: str) -> Call[int]:
    """CountShapes."""
    return Call("ShapeService/CountShapes",
                pb.CountShapesRequest(collection=collection, filter=text_of(filter, "filter"),
                                      state=state_number(state), key_prefix=text_of(key_prefix, "key_prefix")),
                lambda message: int(message.count))


def count_by_value(collection: str, metadata_key: str, filter: str, state: Optional[types.State],
                   max_values: int) -> Call[types.ValueCounts]:
    """CountByValue."""
    return Call("ShapeService/CountByValue",
                pb.CountByValueRequest(collection=collection, metadata_key=text_of(metadata_key, "metadata_key"),
                                       filter=text_of(filter, "filter"),
                                       state=state_number(state), max_values=max_values), value_counts_of)


def delete(collection: str, key: str, expected_version: Optional[int]) -> Call[types.Shape]:
    """DeleteShape."""
    request = pb.DeleteShapeRequest(shape=_ref(collection, key))
    if expected_version is not None:
        request.expected_version = expected_version
    return Call("ShapeService/DeleteShape", request, answered_shape_of, idempotent=False)


def _select(selection: Any, keys: Optional[Sequence[str]], filter: Optional[str]) -> None:
    if (keys is None) == (filter is None):
        raise InvalidInput("invalid_argument", "give either keys or a filter; the filter \"\" means all shapes")
    if keys is not None:
        selection.keys.SetInParent()
        selection.keys.keys.extend(_keys(keys))
    else:
        selection.filter = text_of(filter, "filter")


def delete_many(collection: str, keys: Optional[Sequence[str]], filter: Optional[str]) -> Call[types.Deleted]:
    """DeleteShapes."""
    request = pb.DeleteShapesRequest(collection=collection)
    _select(request.selection, keys, filter)
    return Call("ShapeService/DeleteShapes", request,
                lambda message: types.Deleted(message.deleted, tuple(message.missing)), idempotent=False,
                bounded=False)


def retry(collection: str, keys: Optional[Sequence[str]], filter: Optional[str]) -> Call[types.Retried]:
    """RetryShapes."""
    request = pb.RetryShapesRequest(collection=collection)
    _select(request.selection, keys, filter)
    return Call("ShapeService/RetryShapes", request, lambda message: types.Retried(
        message.queued, message.left, tuple(message.not_failed), tuple(message.missing)), bounded=False)


def update_metadata(collection: str, key: Optional[str], filter: Optional[str], put: Optional[types.Metadata],
                    remove: Sequence[str], replace_all: bool,
                    expected_version: Optional[int]) -> Call[types.MetadataUpdate]:
    """UpdateMetadata, by key or by filter. One by key can be repeated: what it sets stays set."""
    request = pb.UpdateMetadataRequest(collection=collection)
    if key is not None:
        request.key = text_of(key, "key")
    else:
        request.filter = text_of(filter, "filter")
    fill_metadata_change(request.change, put, tuple(remove), replace_all)
    if expected_version is not None:
        request.expected_version = expected_version
    return Call("ShapeService/UpdateMetadata", request, metadata_update_of,
                idempotent=key is not None and expected_version is None, bounded=key is not None)


def watch(collection: str, key: str,
          progress: Optional[Callable[[types.IngestEvent], None]]) -> Call[types.IngestEvent]:
    """WatchIngest."""
    return Call("ShapeService/WatchIngest", pb.WatchIngestRequest(shape=_ref(collection, key)),
                collect=lambda: Last(event_of, progress), bounded=False)


def signature(collection: str, key: str) -> Call[types.Signature]:
    """GetSignature."""
    return Call("ShapeService/GetSignature", pb.GetSignatureRequest(shape=_ref(collection, key)),
                lambda message: signature_of(message.signature))


class _Segments(Collector[types.Segmentation]):
    def __init__(self) -> None:
        self._summary: Any = None
        self._chunks: List[bytes] = []
        self._segments: List[int] = []

    def take(self, message: Any) -> None:
        if message.HasField("summary"):
            self._summary = message.summary
        else:
            self._chunks.append(message.chunk.xyz)
            self._segments.extend(message.chunk.segments)

    def result(self) -> types.Segmentation:
        data = b"".join(self._chunks)
        if self._summary is None or len(data) != 12 * len(self._segments):
            raise ShapeDBError("malformed_stream", "the server sent points and segments that do not belong together")
        return types.Segmentation(report_of(self._summary.report), signature_of(self._summary.signature),
                                  unpack(data, vector_of(self._summary.origin)),
                                  np.array(self._segments, dtype=np.int32))


def segments(collection: str, key: str) -> Call[types.Segmentation]:
    """GetSegments."""
    return Call("ShapeService/GetSegments", pb.GetSegmentsRequest(shape=_ref(collection, key)),
                collect=_Segments)


def segment(scan: Packed, *, profile: Optional[types.Profile], parameters: Optional[types.Parameters],
            summary_only: bool, drop_plane: bool, largest_object: bool,
            progress: Showing) -> Call[types.Segmentation]:
    """Segment."""
    header = pb.SegmentHeader(summary_only=summary_only)
    fill_scan(header, scan)
    fill_parameters(profile, parameters, header)
    fill_isolation(header.isolation, drop_plane, largest_object)
    return Call("ShapeService/Segment", upload(pb.SegmentRequest, header, [scan], progress),
                collect=_Segments)


KEYS_AT_ONCE = 1000
"""Keys that one call may name."""


def batches(keys: Sequence[str], size: int = KEYS_AT_ONCE) -> Iterator[Tuple[str, ...]]:
    """Keys in pieces that one call may have."""
    for at in range(0, len(keys), size):
        yield tuple(keys[at:at + size])
