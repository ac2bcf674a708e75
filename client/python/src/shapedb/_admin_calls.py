# SPDX-License-Identifier: Apache-2.0
"""The calls about collections and the server itself, as values."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from datetime import datetime, timezone
from typing import Any, BinaryIO, Callable, Dict, Iterator, List, Optional, Sequence, Tuple

from shapedb.v1 import admin_service_pb2 as admin_pb
from shapedb.v1 import collection_service_pb2 as collection_pb

from . import _admin_types as types
from . import _increments as increments
from ._call import Call, Collector
from ._connection import PathLike
from ._errors import InvalidInput, ShapeDBError
from ._points import text_of
from ._progress import Showing, reporter
from ._types import CollectionInfo, Parameters, Profile
from ._wire import collection_of, enum_number, fill_parameters, info_of, key_of, plain

_CHUNK = 1 << 20


def create_collection(name: str, description: str, profile: Optional[Profile],
                      parameters: Optional[Parameters]) -> Call[CollectionInfo]:
    """CreateCollection."""
    request = collection_pb.CreateCollectionRequest(name=name, description=description)
    fill_parameters(profile, parameters, request)
    return Call("CollectionService/CreateCollection", request, collection_of, idempotent=False)


def get_collection(name: str) -> Call[CollectionInfo]:
    """GetCollection."""
    return Call("CollectionService/GetCollection", collection_pb.GetCollectionRequest(name=name), collection_of)


def list_collections() -> Call[Tuple[CollectionInfo, ...]]:
    """ListCollections."""
    return Call("CollectionService/ListCollections", collection_pb.ListCollectionsRequest(),
                lambda message: tuple(map(collection_of, message.collections)))


def delete_collection(name: str, force: bool) -> Call[None]:
    """DeleteCollection."""
    return Call("CollectionService/DeleteCollection",
                collection_pb.DeleteCollectionRequest(name=name, force=force), _nothing, idempotent=False)


def _nothing(message: Any) -> None:
    del message


def rename_collection(name: str, new_name: str) -> Call[CollectionInfo]:
    """RenameCollection."""
    return Call("CollectionService/RenameCollection",
                collection_pb.RenameCollectionRequest(name=name, new_name=new_name), collection_of,
                idempotent=False)


def set_alias(alias: str, collection: str) -> Call[CollectionInfo]:
    """SetAlias."""
    return Call("CollectionService/SetAlias", collection_pb.SetAliasRequest(alias=alias, collection=collection),
                collection_of)


def delete_alias(alias: str) -> Call[None]:
    """DeleteAlias."""
    return Call("CollectionService/DeleteAlias", collection_pb.DeleteAliasRequest(alias=alias), _nothing,
                idempotent=False)


class _Rebuild(Collector[Tuple[types.RebuildProgress, ...]]):
    def __init__(self, progress: Optional[Callable[[types.RebuildProgress], None]]) -> None:
        self._progress = progress
        self._last: Dict[str, types.RebuildProgress] = {}

    def take(self, message: Any) -> None:
        now = plain(types.RebuildProgress, message)
        self._last[now.collection] = now
        if self._progress is not None:
            self._progress(now)

    def result(self) -> Tuple[types.RebuildProgress, ...]:
        return tuple(self._last.values())


def rebuild(collection: str, cache_only: bool, profile: Optional[Profile], parameters: Optional[Parameters],
            detach: bool,
            progress: Optional[Callable[[types.RebuildProgress], None]]) -> Call[Tuple[types.RebuildProgress, ...]]:
    """Rebuild."""
    request = admin_pb.RebuildRequest(collection=collection, cache_only=cache_only, detach=detach)
    fill_parameters(profile, parameters, request)
    return Call("AdminService/Rebuild", request, collect=lambda: _Rebuild(progress), idempotent=False, bounded=False)


def cancel_rebuild(collection: str) -> Call[None]:
    """CancelRebuild."""
    return Call("AdminService/CancelRebuild", admin_pb.CancelRebuildRequest(collection=collection), _nothing,
                idempotent=False)


class _Backup(Collector[types.BackupReport]):
    """Writes to another name first; the file appears complete or not at all."""

    def __init__(self, path: str, progress: Showing) -> None:
        self._path = path
        self._report = reporter(progress, "download")
        self._sum = hashlib.sha256()
        self._bytes = 0
        self._total = 0
        self._told = b""
        try:
            handle, self._partial = tempfile.mkstemp(prefix=os.path.basename(path) + ".", suffix=".partial",
                                                     dir=os.path.dirname(path) or ".")
        except OSError as error:
            raise _unwritable(path, error) from None
        self._file: BinaryIO = os.fdopen(handle, "wb")

    def take(self, message: Any) -> None:
        self._total = message.total_bytes or self._total
        self._told = message.sha256 or self._told
        try:
            self._file.write(message.data)
        except OSError as error:
            raise _unwritable(self._path, error) from None
        self._sum.update(message.data)
        self._bytes += len(message.data)
        self._report(self._bytes, self._total)

    def result(self) -> types.BackupReport:
        if self._bytes != self._total:
            raise ShapeDBError("count_mismatch", f"the server sent {self._bytes} of {self._total} bytes")
        if self._sum.digest() != self._told:
            raise ShapeDBError("checksum_mismatch", "the copy was damaged in transfer: make it again")
        try:
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            os.replace(self._partial, self._path)
        except OSError as error:
            raise _unwritable(self._path, error) from None
        return types.BackupReport(self._bytes, self._sum.hexdigest())

    def abandon(self) -> None:
        with contextlib.suppress(OSError):
            self._file.close()
        with contextlib.suppress(OSError):
            os.unlink(self._partial)


class _Increment(_Backup):
    """What a server from before increments sends is refused: it is everything."""

    def take(self, message: Any) -> None:
        if self._bytes == 0 and not message.data.startswith(increments.MAGIC):
            raise ShapeDBError("rejected", "the server makes no increments, only full backups: it is an older one")
        super().take(message)


def _unwritable(path: str, error: OSError) -> ShapeDBError:
    return ShapeDBError("file_not_writable", f"{path} cannot be written: {error.strerror}")


def backup(path: PathLike, since: Optional[PathLike], progress: Showing) -> Call[types.BackupReport]:
    """Backup, of everything or of what has changed since another."""
    request = admin_pb.BackupRequest()
    if since is None:
        return Call("AdminService/Backup", request, collect=lambda: _Backup(os.fspath(path), progress), bounded=False)
    if os.path.exists(path):  # others may build on it
        raise ShapeDBError("already_exists",
                           f"'{os.fspath(path)}' exists, and an increment replaces no file: choose a new name")
    manifest = increments.manifest_of(os.fspath(since))
    request.since.bytes, request.since.sha256 = manifest.backup
    request.since.block_bytes, request.since.block_hashes = manifest.block_bytes, manifest.hashes
    return Call("AdminService/Backup", request, collect=lambda: _Increment(os.fspath(path), progress), bounded=False)


def export(collection: str, path: PathLike, progress: Showing) -> Call[types.BackupReport]:
    """ExportCollection."""
    return Call("AdminService/ExportCollection", admin_pb.ExportCollectionRequest(collection=collection),
                collect=lambda: _Backup(os.fspath(path), progress), bounded=False)


def _chunks_of(paths: Sequence[PathLike], progress: Showing) -> Callable[[], Iterator[Any]]:
    """The size goes with the first chunk, the checksum with the last."""
    chain = increments.Chain([os.fspath(path) for path in paths])

    def chunks() -> Iterator[Any]:
        report = reporter(progress, "upload")
        checksum = hashlib.sha256()
        sent = 0
        for data in chain.pieces(_CHUNK):
            checksum.update(data)
            chunk = admin_pb.BackupChunk(data=data, total_bytes=chain.bytes if sent == 0 else 0)
            sent += len(data)
            if sent == chain.bytes:
                chunk.sha256 = checksum.digest()
            yield chunk
            report(sent, chain.bytes)

    return chunks


def restore(paths: Sequence[PathLike], progress: Showing) -> Call[types.Restored]:
    """Restore, of a full backup and its increments."""
    return Call("AdminService/Restore", _chunks_of(paths, progress),
                lambda message: plain(types.Restored, message), idempotent=False, bounded=False)


def import_collection(path: PathLike, name: str, progress: Showing) -> Call[types.Imported]:
    """ImportCollection."""
    text_of(name, "the name of a collection")
    chunks = _chunks_of([path], progress)

    def messages() -> Iterator[Any]:
        yield admin_pb.ImportCollectionRequest(header=admin_pb.ImportCollectionHeader(collection=name))
        for chunk in chunks():
            yield admin_pb.ImportCollectionRequest(chunk=chunk)

    return Call("AdminService/ImportCollection", messages, lambda message: plain(types.Imported, message),
                idempotent=False, bounded=False)


class _Check(Collector[Tuple[str, ...]]):
    def __init__(self, progress: Showing) -> None:
        self._report = reporter(progress, "check")
        self._problems: List[str] = []

    def take(self, message: Any) -> None:
        self._problems.extend(message.problems)
        self._report(message.done, message.total)

    def result(self) -> Tuple[str, ...]:
        return tuple(self._problems)


def check(progress: Showing, acknowledge: bool) -> Call[Tuple[str, ...]]:
    """Check."""
    return Call("AdminService/Check", admin_pb.CheckRequest(acknowledge=acknowledge), collect=lambda: _Check(progress),
                bounded=False)


def stats() -> Call[types.Stats]:
    """Stats."""
    return Call("AdminService/Stats", admin_pb.StatsRequest(), lambda message: plain(types.Stats, message))


def server_info() -> Call[types.ServerInfo]:
    """ServerInfo."""
    return Call("AdminService/ServerInfo", admin_pb.ServerInfoRequest(), info_of)


_HEALTH: Tuple[types.Health, ...] = ("unknown", "serving", "not_serving")


def health(service: str) -> Call[types.Health]:
    """grpc.health.v1: asked and answered with messages of the same bytes, see `_transport`."""
    return Call("Health/Check", collection_pb.GetCollectionRequest(name=text_of(service, "service")),
                lambda message: _HEALTH[message.count] if message.count < len(_HEALTH) else "unknown",
                idempotent=False)


def create_key(name: str, role: types.Role, collections: Sequence[str], expires: Optional[datetime],
               limits: types.KeyLimits) -> Call[types.CreatedKey]:
    """CreateKey."""
    if isinstance(collections, str):
        raise InvalidInput("invalid_argument", "collections is a text; give a list of names")
    request = admin_pb.CreateKeyRequest(
        name=text_of(name, "name"), collections=[text_of(one, "the name of a collection") for one in collections])
    request.role = enum_number(admin_pb.Role, "ROLE_", role, "role")  # type: ignore[assignment]
    for limit in ("calls_per_second", "scans_per_day", "bytes_per_day"):
        setattr(request.limits, limit, getattr(limits, limit))
    if expires is not None:
        if expires.tzinfo is None:
            raise InvalidInput("invalid_argument", "expires has no time zone: add one to it, e.g. timezone.utc")
        request.expires.FromDatetime(expires.astimezone(timezone.utc))
    return Call("AdminService/CreateKey", request,
                lambda message: types.CreatedKey(key_of(message.key), message.secret), idempotent=False)


def list_keys() -> Call[Tuple[types.Key, ...]]:
    """ListKeys."""
    return Call("AdminService/ListKeys", admin_pb.ListKeysRequest(),
                lambda message: tuple(map(key_of, message.keys)))


def revoke_key(id: str) -> Call[types.Key]:
    """RevokeKey."""
    return Call("AdminService/RevokeKey", admin_pb.RevokeKeyRequest(id=text_of(id, "id")), lambda message: key_of(message.key),
                idempotent=False)
