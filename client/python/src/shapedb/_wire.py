# SPDX-License-Identifier: Apache-2.0
"""Messages to values and values to messages: shapes, collections, maintenance. `_search_wire` has searches."""

from __future__ import annotations

import dataclasses
from datetime import datetime, timezone
from typing import Any, Dict, Mapping, Optional, Tuple, Type, TypeVar

import numpy as np

from shapedb.v1 import admin_service_pb2 as admin_pb
from shapedb.v1 import shape_service_pb2 as shape_pb
from shapedb.v1 import types_pb2 as types_pb

from . import _admin_types as admin
from . import _types as types
from ._errors import InvalidInput
from ._points import read_only, text_of
from ._vectors import vector_of

T = TypeVar("T")

_UNITS: Dict[types.Unit, str] = {"none": "NONE", "mm": "MILLIMETRE", "cm": "CENTIMETRE", "m": "METRE", "in": "INCH"}


def enum_number(enum: Any, prefix: str, name: str, what: str) -> int:
    """The number of an enum value by our name: "insert_only" is ADD_MODE_INSERT_ONLY."""
    full = prefix + name.upper()
    if full not in enum.keys() or full.endswith("_UNSPECIFIED"):
        names = ", ".join(key[len(prefix):].lower() for key in enum.keys() if not key.endswith("_UNSPECIFIED"))
        raise InvalidInput("invalid_argument", f"{what} is '{name}'; it must be one of: {names}")
    return int(enum.Value(full))


def enum_name(enum: Any, prefix: str, number: int) -> Any:
    """Our name of an enum value; None if it is unspecified or unknown here."""
    if number not in enum.values():
        return None
    name = enum.Name(number)[len(prefix):].lower()
    return None if name == "unspecified" else name


def plain(cls: Type[T], message: Any, **others: Any) -> T:
    """A dataclass from the fields of a message with the same names; `others` are those that need more."""
    names = message.DESCRIPTOR.fields_by_name
    values = {field.name: getattr(message, field.name) for field in dataclasses.fields(cls)
              if field.name not in others and field.name in names}
    return cls(**values, **others)


def optional(message: Any, field: str) -> Any:
    """A field, or None if it is not set."""
    return getattr(message, field) if message.HasField(field) else None


def time_of(message: Any) -> datetime:
    """Of a google.protobuf.Timestamp."""
    return datetime.fromtimestamp(message.seconds, timezone.utc).replace(microsecond=message.nanos // 1000)


def time_or_none(message: Any, field: str) -> Optional[datetime]:
    """Of a field that may not be set."""
    return time_of(getattr(message, field)) if message.HasField(field) else None


def metadata_texts(metadata: types.Metadata) -> Dict[str, str]:
    """Metadata as they are sent. Raises `InvalidInput`."""
    texts = {}
    for key, value in metadata.items():
        if isinstance(value, bool) or not isinstance(value, (str, int, float, np.integer, np.floating)):
            raise InvalidInput("invalid_argument",
                               f"metadata '{key}' is of {type(value).__name__}; it must be text or a number")
        if text_of(key, "a metadata key").startswith("shapedb."):
            raise InvalidInput("invalid_argument",
                               f"metadata '{key}': keys that begin with shapedb. are kept for the client itself")
        texts[key] = text_of(value if isinstance(value, str) else str(value), f"metadata '{key}'")
    return texts


# ---------------------------------------------------------------------------------------------------------- shapes


def failure_of(message: Any) -> types.ShapeFailure:
    """Of a `Failure`."""
    return types.ShapeFailure(message.error, message.message)


def state_of(number: int) -> types.State:
    """Of a `ShapeState`."""
    state: types.State = enum_name(types_pb.ShapeState, "SHAPE_STATE_", number) or "pending"
    return state


def state_number(state: Optional[types.State]) -> Any:
    """None: any state."""
    return 0 if state is None else enum_number(types_pb.ShapeState, "SHAPE_STATE_", state, "state")


def shape_of(message: Any, change: int = 0) -> types.Shape:
    """Of a `Shape`, and the change that the answer names beside it."""
    return plain(types.Shape, message, change=change, state=state_of(message.state),
                 metadata=dict(sorted(message.metadata.items())), created=time_of(message.created), updated=time_of(message.updated),
                 failure=failure_of(message.failure) if message.HasField("failure") else None,
                 quality=optional(message, "quality"))


def answered_shape_of(message: Any) -> types.Shape:
    """Of an answer that names its change: to GetShape, AddShape and DeleteShape."""
    return shape_of(message.shape, message.change)


def added_of(message: Any) -> types.Added:
    """Of an `AddShapeResponse`."""
    outcome = enum_name(shape_pb.AddShapeResponse.Outcome, "OUTCOME_", message.outcome)
    return types.Added(outcome, answered_shape_of(message))


def event_of(message: Any) -> types.IngestEvent:
    """Of an `IngestEvent`."""
    return plain(types.IngestEvent, message, state=state_of(message.state),
                 failure=failure_of(message.failure) if message.HasField("failure") else None,
                 quality=optional(message, "quality"))


def value_counts_of(message: Any) -> types.ValueCounts:
    """Of a `CountByValueResponse`."""
    return types.ValueCounts({one.value: one.shapes for one in message.values}, message.other_values,
                             message.other_shapes, message.shapes_without)


def metadata_update_of(message: Any) -> types.MetadataUpdate:
    """Of an `UpdateMetadataResponse`."""
    return types.MetadataUpdate(
        message.changed, message.unchanged, message.refused, message.first_refused_key or None,
        failure_of(message.first_refused) if message.HasField("first_refused") else None,
        shape_of(message.shape) if message.HasField("shape") else None)


# ------------------------------------------------------------------------------------- collections and parameters


def fill_parameters(profile: Optional[types.Profile], parameters: Optional[types.Parameters], message: Any) -> None:
    """Into a message with `profile`, `segmentation` and `signature`."""
    if profile is not None:
        message.profile = enum_number(types_pb.Profile, "PROFILE_", profile, "profile")
    for field in dataclasses.fields(parameters) if parameters is not None else ():
        value = getattr(parameters, field.name)
        if value is None:
            continue
        if field.name == "unit":
            if value not in _UNITS:
                raise InvalidInput("invalid_argument", f"unit is '{value}'; it must be one of: {', '.join(_UNITS)}")
            value = types_pb.LengthUnit.Value("LENGTH_UNIT_" + _UNITS[value])
        elif field.name == "interior_method":
            value = enum_number(types_pb.InteriorMethod, "INTERIOR_METHOD_", value, field.name)
        part = message.segmentation if field.name in message.segmentation.DESCRIPTOR.fields_by_name \
            else message.signature
        try:
            setattr(part, field.name, value)
        except (TypeError, ValueError):
            raise InvalidInput("invalid_argument", f"{field.name} is {value!r}: not a value of its type") from None


def unit_of(number: int) -> Optional[types.Unit]:
    """Of a `LengthUnit`; None for one that a later version may have."""
    units: Dict[int, types.Unit] = {types_pb.LengthUnit.Value("LENGTH_UNIT_" + name): unit
                                    for unit, name in _UNITS.items()}
    return units.get(number)


def _parameters_of(message: Any) -> types.Parameters:
    values = {field.name: optional(part, field.name) if field.has_presence else getattr(part, field.name)
              for part in (message.segmentation, message.signature) for field in part.DESCRIPTOR.fields}
    known = {field.name for field in dataclasses.fields(types.Parameters)}
    values["unit"] = unit_of(values["unit"])
    values["interior_method"] = enum_name(types_pb.InteriorMethod, "INTERIOR_METHOD_", values["interior_method"] or 0)
    return types.Parameters(**{name: value for name, value in values.items() if name in known})


def collection_of(message: Any) -> types.CollectionInfo:
    """Of a `Collection`."""
    return plain(types.CollectionInfo, message,
                 profile=enum_name(types_pb.Profile, "PROFILE_", message.profile) or "default",
                 parameters=_parameters_of(message), created=time_of(message.created), ready=message.shapes_ready,
                 failed=message.shapes_failed, aliases=tuple(message.aliases))


# ------------------------------------------------------------------------------------------------------ signatures


def signature_of(message: Any) -> types.Signature:
    """Of a `Signature`."""
    points = tuple(
        plain(types.WeightedPoint, point, position=read_only(vector_of(point.position)),
              extents=tuple(point.extents)) for point in message.points)
    attributes = message.attributes if message.HasField("attributes") else None
    statistics = () if attributes is None else tuple(
        types.Statistic(one.name, tuple(one.shares), one.of_interior) for one in attributes.statistics)
    return types.Signature(points, message.scale, message.volume, message.encoded,
                           None if attributes is None else attributes.quality, statistics)


def report_of(message: Any) -> types.SegmentationReport:
    """Of a `SegmentationReport`."""
    source = enum_name(types_pb.InteriorSource, "INTERIOR_SOURCE_", message.interior_source)
    doubt = enum_name(types_pb.InteriorDoubt, "INTERIOR_DOUBT_", message.doubt)
    return plain(types.SegmentationReport, message,
                 quality=message.quality if message.HasField("quality") else 1.0,
                 interior_source=source or "walk", doubt=doubt or "none",
                 stages={stage.stage: stage.seconds for stage in message.stages})


# ----------------------------------------------------------------------------------------------------- maintenance


def info_of(message: Any) -> admin.ServerInfo:
    """Of a `ServerInfoResponse`."""
    return plain(admin.ServerInfo, message, started=time_of(message.started),
                 limits=plain(admin.Limits, message.limits),
                 limit_table=tuple(plain(admin.Limit, limit) for limit in message.limit_table))


def key_of(message: Any) -> admin.Key:
    """Of a `Key`."""
    return plain(admin.Key, message, role=enum_name(admin_pb.Role, "ROLE_", message.role) or "reader",
                 collections=tuple(message.collections), limits=plain(admin.KeyLimits, message.limits),
                 created=time_of(message.created), expires=time_or_none(message, "expires"),
                 revoked=time_or_none(message, "revoked"))


def fill_metadata_change(change: Any, put: Optional[Mapping[str, Any]], remove: Tuple[str, ...],
                         replace_all: bool) -> None:
    """Into a `MetadataChange`."""
    change.SetInParent()
    change.set.update(metadata_texts(put or {}))
    change.remove.extend(text_of(key, "a metadata key") for key in remove)
    change.replace_all = replace_all
