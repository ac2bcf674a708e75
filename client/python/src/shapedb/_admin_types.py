# SPDX-License-Identifier: Apache-2.0
"""What the maintenance of a server takes and returns: values that do not change."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal, Optional, Tuple

Role = Literal["reader", "writer", "admin"]
Health = Literal["unknown", "serving", "not_serving"]


@dataclass(frozen=True)
class Stats:
    """What a server holds and does."""

    collections: int
    shapes_pending: int
    shapes_ready: int
    shapes_failed: int
    cached_signatures: int
    cache_bytes: int
    queued_jobs: int
    queued_bytes: int
    running_jobs: int
    database_bytes: int
    wal_bytes: int
    point_bytes: int
    """Uncompressed."""
    stored_point_bytes: int
    """Compressed."""
    uptime_seconds: float
    searches: int
    """Since the start."""
    ingested: int
    """Since the start."""
    missing_commits: int
    """Acknowledged changes that the database did not have when the server started."""


@dataclass(frozen=True)
class Limits:
    """The most a request may ask for; `ServerInfo.limit_table` has all limits."""

    max_points: int
    max_k: int
    max_batch: int
    max_queued_jobs: int
    max_queued_bytes: int
    max_chunk_bytes: int


@dataclass(frozen=True)
class Limit:
    """One limit that a client can meet; docs/limits.md lists all."""

    name: str
    """With a dot: the setting that changes it."""
    value: int
    """The most that is allowed; the least where the name says min."""
    unit: str
    """bytes, points, calls, s, ms, ..."""
    bounds: str
    """For people: what it bounds."""
    refusal: str
    """The `ShapeDBError.reason` beyond it; empty: no call fails with a name, `bounds` says what happens."""


@dataclass(frozen=True)
class ServerInfo:
    """Which server this is."""

    version: str
    schema_version: int
    """0: the database is damaged and cannot tell."""
    started: datetime
    limits: Limits
    ingest_threads: int
    limit_table: Tuple[Limit, ...] = field(repr=False)
    """Every limit that a client can meet, in the order of docs/limits.md."""


@dataclass(frozen=True)
class RebuildProgress:
    """How far the rebuild of one collection is."""

    collection: str
    done: int
    total: int
    failed: int
    """Of those done: could not be segmented."""
    finished: bool
    seconds: float


@dataclass(frozen=True)
class BackupReport:
    """A copy that was written."""

    bytes: int
    sha256: str


@dataclass(frozen=True)
class Restored:
    """What a server holds after a restore."""

    collections: int
    shapes: int


@dataclass(frozen=True)
class Imported:
    """A collection that was added from a file."""

    collection: str
    shapes: int
    """In any state."""
    shapes_pending: int
    """Of these: queued."""


@dataclass(frozen=True)
class KeyLimits:
    """What the holder of a key may use; 0: without limit."""

    calls_per_second: int = 0
    scans_per_day: int = 0
    bytes_per_day: int = 0


@dataclass(frozen=True)
class Key:
    """An API key without its secret."""

    id: str
    name: str
    role: Role
    collections: Tuple[str, ...]
    """Those it may use; empty: all."""
    limits: KeyLimits
    created: datetime
    expires: Optional[datetime]
    revoked: Optional[datetime]
    scans_today: int
    bytes_today: int


@dataclass(frozen=True)
class CreatedKey:
    """A new API key. Its secret is told this once."""

    key: Key
    secret: str = field(repr=False)
    """The whole key, as a client sends it."""
