# SPDX-License-Identifier: Apache-2.0
"""What calls about shapes and collections take and return: values that do not change."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Callable, Dict, Literal, Mapping, Optional, Tuple, Union

import numpy.typing as npt
import numpy as np

from ._points import FloatArray

State = Literal["pending", "ready", "failed"]
AddMode = Literal["upsert", "insert_only", "update_only", "same_points"]
Outcome = Literal["created", "replaced", "metadata_changed", "unchanged", "retried"]
Order = Literal["id", "key", "updated"]
Profile = Literal["default", "paper"]
Unit = Literal["none", "mm", "cm", "m", "in"]
InteriorMethod = Literal["walk", "adaptive"]
InteriorSource = Literal["walk", "potential", "thickened"]
InteriorDoubt = Literal["none", "no_surface", "thin_walls", "few_points"]

Metadata = Mapping[str, Union[str, int, float]]
"""Up to 64 entries of text; numbers are written as text."""


@dataclass(frozen=True)
class Progress:
    """How far something is."""

    stage: str
    """What is done now, e.g. "upload"."""
    done: int
    total: int
    """In the unit of `done`; 0: unknown."""


ProgressListener = Callable[[Progress], None]
"""Is told about progress."""


@dataclass(frozen=True)
class ShapeFailure:
    """Why a shape is failed."""

    reason: str
    """One of `shapedb.REASONS`."""
    message: str


@dataclass(frozen=True)
class Shape:
    """What the server knows about one shape, without its points."""

    collection: str
    key: str
    id: int
    """Given by the server, rising; breaks ties in rankings."""
    version: int
    """1 when inserted, one more with every change."""
    state: State
    point_count: int
    sha256: bytes = field(repr=False)
    """Of the points as sent."""
    metadata: Dict[str, str] = field(hash=False)
    created: datetime = field(repr=False)
    updated: datetime = field(repr=False)
    failure: Optional[ShapeFailure] = None
    """Set exactly when the state is "failed"."""
    quality: Optional[float] = None
    """How certain the interior is, [0, 1]; below 0.5 it is a guess. None unless the state is "ready"."""
    change: int = field(default=0, compare=False)
    """Of `add`, `get` and `delete`, where several servers share a database: with it as `at_least`, a search on any of
    them knows the shape as it is here. Otherwise 0."""

    @property
    def label(self) -> Optional[str]:
        """The metadata "label"."""
        return self.metadata.get("label")


@dataclass(frozen=True)
class Added:
    """What became of an upload."""

    outcome: Outcome
    shape: Shape


@dataclass(frozen=True)
class IngestEvent:
    """A step of the way from an upload to a searchable shape."""

    state: State
    stage: str
    """While pending: "queued", or the stage that is running."""
    done: int
    total: int
    """In a unit of the stage; 0: unknown."""
    failure: Optional[ShapeFailure] = None
    quality: Optional[float] = None


@dataclass(frozen=True)
class Found:
    """Shapes read by their keys."""

    shapes: Tuple[Shape, ...]
    """In the order of the keys."""
    missing: Tuple[str, ...]
    """Keys that no shape has."""


@dataclass(frozen=True)
class Page:
    """Part of a listing."""

    shapes: Tuple[Shape, ...]
    next_cursor: str
    """For the next page; empty on the last."""


@dataclass(frozen=True)
class ValueCounts:
    """How many shapes have which value under a metadata key."""

    values: Dict[str, int] = field(hash=False)
    """Most frequent first."""
    other_values: int
    """Values beyond those named."""
    other_shapes: int
    """Shapes that have these."""
    without: int
    """Shapes that do not have the key."""


@dataclass(frozen=True)
class Deleted:
    """What became of a deletion of many shapes."""

    count: int
    missing: Tuple[str, ...]
    """Keys that no shape had."""


@dataclass(frozen=True)
class Retried:
    """What became of failed shapes that were to be tried again."""

    queued: int
    left: int
    """Failed as before, for want of room in the queue: call again later."""
    not_failed: Tuple[str, ...]
    """Keys of shapes that had not failed."""
    missing: Tuple[str, ...]
    """Keys that no shape had."""


@dataclass(frozen=True)
class MetadataUpdate:
    """What became of a change of metadata."""

    changed: int
    unchanged: int
    """Shapes that had this metadata before."""
    refused: int = 0
    """Shapes left as they were, because they would have had too many entries."""
    first_refused: Optional[str] = None
    """The key of one of them."""
    first_refusal: Optional[ShapeFailure] = None
    shape: Optional[Shape] = None
    """Of a change by key: as it is now."""


@dataclass(frozen=True)
class Parameters:
    """How signatures are made; docs/command-line.md explains each. None: the profile's value; in a rebuild, as it
    was."""

    big_ball_ratio: Optional[float] = None
    deep_angle_degrees: Optional[float] = None
    hull_angle_degrees: Optional[float] = None
    merge_ratio: Optional[float] = None
    merge_contrast: Optional[float] = None
    min_segment_share: Optional[float] = None
    max_segments: Optional[int] = None
    decimate_to: Optional[int] = None
    outlier_ratio: Optional[float] = None
    smoothing_reach: Optional[float] = None
    thinning: Optional[float] = None
    interior_method: Optional[InteriorMethod] = None
    max_points: Optional[int] = None
    """The heaviest segments kept, 1 to 16."""
    attributes: Optional[bool] = None
    views: Optional[bool] = None
    unit: Optional[Unit] = None
    """Of the scans of a collection: with one, sizes count."""


@dataclass(frozen=True)
class CollectionInfo:
    """A collection as it is."""

    name: str
    description: str
    profile: Profile
    parameters: Parameters = field(repr=False)
    """All of them set, unless they could not be read."""
    generation: int
    """One more with every finished rebuild."""
    created: datetime = field(repr=False)
    shapes: int
    """In any state."""
    ready: int
    """Found by searches."""
    failed: int
    aliases: Tuple[str, ...]
    """Other names that stand for it."""
    damage: str = ""
    """Why it cannot be searched, and what to do: what is stored of it is damaged. Empty: it can."""

    @property
    def pending(self) -> int:
        """Shapes that wait to be segmented, or are being."""
        return self.shapes - self.ready - self.failed


@dataclass(frozen=True, eq=False)
class WeightedPoint:
    """One segment of a shape, as its signature keeps it. Lengths are in units of the scan."""

    position: FloatArray
    """Its centre, in coordinates of the scan."""
    weight: float
    """Its volume."""
    volume_share: float
    """Of the whole interior, (0, 1]."""
    peak_radius: float
    """Of the largest ball inside."""
    extents: Tuple[float, ...]
    """Standard deviations along its principal axes, largest first."""


@dataclass(frozen=True)
class Statistic:
    """One histogram that no rotation, mirroring, translation or scale changes."""

    name: str
    shares: Tuple[float, ...]
    of_interior: bool
    """False: of the surface alone, so valid for open scans too."""


@dataclass(frozen=True, eq=False)
class Preview:
    """Some points of a shape, enough for a small picture."""

    key: str
    version: int
    """`Shape.version`: which points these were made of."""
    points: FloatArray = field(repr=False)
    """About the middle of the box of the scan; none if the shape has no surface points (yet), as with profile "paper"."""
    normals: FloatArray = field(repr=False)
    """Of each point; n may as well be -n."""


@dataclass(frozen=True, eq=False)
class Signature:
    """What a search compares. Can be searched with: `collection.search(signature)`."""

    points: Tuple[WeightedPoint, ...]
    """The heaviest segments, in descending order of weight."""
    scale: float
    """Diagonal of the bounding box."""
    volume: float
    """Of the whole interior."""
    encoded: bytes = field(repr=False)
    """The stored form."""
    quality: Optional[float] = None
    """How certain the interior is, [0, 1]."""
    statistics: Tuple[Statistic, ...] = field(default=(), repr=False)


@dataclass(frozen=True)
class SegmentationReport:
    """What a segmentation did, and how long its stages took."""

    points: int
    points_used: int
    duplicates: int
    outliers: int
    outlier_clusters: int
    tetrahedra: int
    interior_tetrahedra: int
    maxima: int
    segments: int
    volume: float
    delaunay_seconds: float
    total_seconds: float
    angle_degrees: float
    noise: float
    """Standard deviation before smoothing; 0: not measured."""
    quality: float
    """How certain the interior is, [0, 1]."""
    interior_source: InteriorSource
    doubt: InteriorDoubt
    """Why the interior is not to be trusted, beyond what its quality says."""
    stages: Dict[str, float] = field(hash=False)
    """Seconds, in the order they ran."""


@dataclass(frozen=True, eq=False)
class Segmentation:
    """A scan with the segment of each point."""

    report: SegmentationReport
    signature: Signature
    points: FloatArray = field(repr=False)
    """In the order uploaded; empty for a summary."""
    segments: npt.NDArray[np.int32] = field(repr=False)
    """Of each point, 0 being the largest segment; -1: none."""
