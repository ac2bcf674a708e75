# SPDX-License-Identifier: Apache-2.0
"""What searches, comparisons and alignments return: values that do not change."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Dict, Iterator, Literal, Optional, Sequence, Tuple, Union, overload

from . import _text
from ._points import FloatArray
from ._types import SegmentationReport, Shape, Signature, Unit

if TYPE_CHECKING:
    import pandas

Verdict = Literal["same_object", "same_object_bent", "part", "same_kind", "unrelated"]
FitKind = Literal["whole", "one_sided", "piece"]


@dataclass(frozen=True, eq=False)
class Pose:
    """One way of laying a shape on the query."""

    motion: FloatArray = field(repr=False)
    """4 x 4, from coordinates of the shape to those of the query."""
    scale: float
    reflected: bool
    score: float
    """[0, 1]: root of the product of the next two."""
    explained_query: float
    """Share of the query's surface that lies on the shape's, [0, 1]."""
    explained_other: float
    """Share of the part of the shape's surface that the query should have seen that is there, [0, 1]."""
    residual: float
    """Root mean square distance where they meet, as a share of the query's diagonal."""


@dataclass(frozen=True, eq=False)
class FreeAxis:
    """Any turn about this line fits as well."""

    point: FloatArray
    """In coordinates of the query."""
    direction: FloatArray


@dataclass(frozen=True, eq=False)
class Fit:
    """How a shape lies on the query."""

    best: Pose
    kind: FitKind
    """What the query was taken for."""
    misfit: float
    """0: they coincide; about 1: typical of unrelated shapes."""
    certainty: float
    """[0, 1]; 0 if a clearly different pose is as good."""
    left_right_open: bool
    """The points do not tell left from right."""
    alternatives: Tuple[Pose, ...]
    """Clearly different poses that are as good, best first."""
    axes: Tuple[FreeAxis, ...]
    """One for a bottle, three for a ball."""

    @property
    def motion(self) -> FloatArray:
        """That of the best pose: 4 x 4, from coordinates of the shape to those of the query."""
        return self.best.motion

    @property
    def mirrored(self) -> bool:
        """Whether the shape lies on the query only as a mirror image."""
        return self.best.reflected and not self.left_right_open

    def __str__(self) -> str:
        return _text.fit(self, "the query", "the other")


@dataclass(frozen=True)
class Term:
    """One of the distances that make up a score."""

    name: str
    distance: float
    """0: identical; 1: typical of unrelated shapes."""
    weight: float
    """In the mean; the weights sum to 1."""


@dataclass(frozen=True)
class SegmentMatch:
    """Two segments that the alignment brings together."""

    query: int
    """Index into the points of the query's signature."""
    hit: int
    """Index into those of the hit's."""
    share: float
    """Of the similarity, [0, 1]."""
    distance: float
    """Of their centres after the motion, in units of the common size."""


@dataclass(frozen=True, eq=False)
class Why:
    """Why two shapes have the score they have. `print(hit.why)` says it in words."""

    name: str
    """Of the other shape."""
    verdict: Optional[Verdict]
    reliability: float
    """How often such a verdict was right where it was measured, [0, 1]."""
    similarity: float
    dissimilarity: float
    terms: Tuple[Term, ...]
    """The distances that make up the score; empty with signatures of weighted points alone."""
    matches: Tuple[SegmentMatch, ...]
    """Pairs of segments, in descending order of share."""
    unmatched_query: Tuple[int, ...]
    unmatched_hit: Tuple[int, ...]
    degenerate: bool
    """One of the two is a single segment, so any rotation fits."""
    query_shares: Tuple[float, ...] = field(repr=False)
    """Volume shares of the query's segments."""
    motion: FloatArray = field(repr=False)
    """What brings the segments together: 4 x 4. Where there is a fit, the motion of that."""
    scale: float = field(repr=False)
    reflected: bool = field(repr=False)
    fit: Optional[Fit] = field(repr=False)

    @property
    def words(self) -> str:
        """The verdict in words, of mirrored twins "same object, mirrored"; empty if the hit was not verified."""
        return _text.likeness(self.verdict, self.mirrored)

    @property
    def mirrored(self) -> Optional[bool]:
        """Whether the other shape lies on the query only as a mirror image; None if it was not laid on it."""
        return None if self.fit is None else self.fit.mirrored

    def __str__(self) -> str:
        return _text.why(self)


@dataclass(frozen=True, eq=False)
class Hit:
    """A shape found."""

    key: str
    score: float
    """[0, 1]; 1 exactly for identical signatures."""
    verdict: Optional[Verdict]
    """What the hit is to the query; None if it was not verified."""
    verdict_reliability: float
    """How often such a verdict was right where it was measured, [0, 1]."""
    shape: Shape = field(repr=False)
    signature_score: float = field(repr=False)
    """What the signatures alone say."""
    motion: Optional[FloatArray] = field(repr=False)
    """4 x 4, from coordinates of the hit to those of the query: `points @ motion[:3, :3].T + motion[:3, 3]`, or
    `shapedb.transform(points, motion)`. None without explanation."""
    why: Optional[Why] = field(repr=False)
    """None with `explain=False`."""
    fit: Optional[Fit] = field(repr=False)
    """None if the hit was not verified."""
    group: Optional[str] = None
    """With `group_by`: the value that it was found under."""

    @property
    def mirrored(self) -> Optional[bool]:
        """Whether the hit lies on the query only as a mirror image; None if it was not verified."""
        return None if self.fit is None else self.fit.mirrored

    @property
    def metadata(self) -> Dict[str, str]:
        """That of its shape."""
        return self.shape.metadata

    @property
    def label(self) -> Optional[str]:
        """The metadata "label" of its shape."""
        return self.shape.label


@dataclass(frozen=True)
class Group:
    """Hits that have the same value under the key of `group_by`."""

    value: Optional[str]
    """None: their shapes do not have the key."""
    hits: int


@dataclass(frozen=True, eq=False)
class SearchResult(Sequence[Hit]):
    """The hits, best first: a sequence. With `group_by` group after group."""

    hits: Tuple[Hit, ...]
    groups: Tuple[Group, ...]
    """With `group_by`: of the hits, in their order."""
    candidates: int
    """Shapes that were searched."""
    filtered: int
    """Of these, how many pass the filter."""
    scored: int
    """Of these, how many no bound ruled out."""
    verified: int
    """Candidates that were laid on the query."""
    exact: bool
    """False: verifying more candidates could change the hits."""
    pending: int
    """Shapes of the collection that have no signature yet."""
    unit: Optional[Unit]
    """Of all lengths of the query; None or "none" if the collection has no unit."""
    left_right_untold: bool
    """With `reflection=False`: nothing was laid on the query, so mirrored twins may be among the hits."""
    covered: float
    """Share of the collection that was searched; 1 unless `allow_partial`."""
    query: Signature = field(repr=False)
    """As it was scored."""
    seconds_segment: float
    seconds_search: float
    report: Optional[SegmentationReport] = field(repr=False)
    """How the scan was segmented; None if the query is no scan."""

    def __len__(self) -> int:
        return len(self.hits)

    @overload
    def __getitem__(self, index: int) -> Hit: ...

    @overload
    def __getitem__(self, index: slice) -> Tuple[Hit, ...]: ...

    def __getitem__(self, index: Union[int, slice]) -> Union[Hit, Tuple[Hit, ...]]:
        return self.hits[index]

    def __iter__(self) -> Iterator[Hit]:
        return iter(self.hits)

    def __str__(self) -> str:
        return _text.table(self.hits)

    def _repr_html_(self) -> str:
        return _text.html_table(self.hits)

    def to_dataframe(self) -> "pandas.DataFrame":
        """One row for each hit, the metadata in columns "metadata.KEY". Needs pandas."""
        from ._frame import hits_frame
        return hits_frame(self.hits)


@dataclass(frozen=True, eq=False)
class Comparison:
    """How alike two stored shapes are."""

    score: float
    verdict: Optional[Verdict]
    verdict_reliability: float
    signature_score: float
    """What the signatures alone say."""
    motion: FloatArray = field(repr=False)
    """4 x 4, from coordinates of the other to those of the first."""
    why: Why = field(repr=False)
    fit: Optional[Fit] = field(repr=False)
    """None if one of them has no surface points."""
    unit: Optional[Unit]
    """Of all lengths of the first shape."""
    left_right_untold: bool
    """With `reflection=False`: without a fit a mirrored twin scores nearly as the shape itself."""
    query: Signature = field(repr=False)
    other: Signature = field(repr=False)

    @property
    def mirrored(self) -> Optional[bool]:
        """Whether the other lies on the first only as a mirror image; None if they were not laid on each other."""
        return None if self.fit is None else self.fit.mirrored
