# SPDX-License-Identifier: Apache-2.0
"""A connection that blocks. Made of `_async_client.py` by scripts/python-sync.py: change that, not this."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from types import TracebackType
from typing import Callable, Mapping, Optional, Sequence, Tuple, Type, TypeVar

from . import _admin_calls as calls
from . import _admin_types as admin
from . import _search_calls as search_calls
from . import _shape_calls as shape_calls
from . import _types as types
from ._collection import Collection
from ._connection import PathLike, target_of
from ._errors import InvalidInput, ShapeDBError
from ._points import Scan, pack, text_of
from ._progress import Showing
from ._retry import RetryPolicy, seconds_of
from ._search_types import Fit
from ._transport import Transport

Self = TypeVar("Self", bound="Client")


def _named(name: str) -> str:
    """The name of a collection. The server takes none for "default", which nobody means who gives one."""
    if name == "":
        raise InvalidInput("invalid_argument", "the name of a collection is empty; that without a name of its own is "
                           "\"default\"")
    return text_of(name, "the name of a collection")


class Client:
    """A connection to one server, opened when first needed and reopened when lost.

    address: HOST, HOST:PORT, [IPV6]:PORT or unix:PATH. api_key, or api_key_file with the key in its first line: never
    sent beyond this machine without TLS. tls: protect the connection; tls_ca (a PEM file) names who signs the server's
    certificate, if this machine does not trust them anyway, and implies tls; server_name, the name in that certificate
    if it is not the host of the address; client_certificate and client_key, for servers that ask for one.

    What is not given comes from the variables that the `shapedb` command reads: SHAPEDB_SERVER, SHAPEDB_API_KEY,
    SHAPEDB_API_KEY_FILE, SHAPEDB_TLS, SHAPEDB_TLS_CA, SHAPEDB_CLIENT_CERTIFICATE, SHAPEDB_CLIENT_KEY. `environment`
    replaces them; `{}` to ignore them.

    timeout: the most seconds one call may take with all its tries; `math.inf` for no limit. It does not limit calls
    that follow work on the server or change many shapes, which say so. retry: see `RetryPolicy`.

    Every call raises `ShapeDBError`, and takes `timeout` for itself. progress: True for a bar, or a function that is
    told (see `Progress`; an upload calls it from another thread, and what it raises is logged). See docs/python.md for
    threads, tasks and forks.
    """

    def __init__(self, address: Optional[str] = None, *, api_key: Optional[str] = None,
                 api_key_file: Optional[PathLike] = None, tls: Optional[bool] = None,
                 tls_ca: Optional[PathLike] = None, client_certificate: Optional[PathLike] = None,
                 client_key: Optional[PathLike] = None, server_name: Optional[str] = None,
                 timeout: Optional[float] = 60.0, retry: RetryPolicy = RetryPolicy(),
                 environment: Optional[Mapping[str, str]] = None) -> None:
        target = target_of(address, api_key=api_key, api_key_file=api_key_file, tls=tls, tls_ca=tls_ca,
                           client_certificate=client_certificate, client_key=client_key, server_name=server_name,
                           environment=environment)
        self._transport = Transport(target, seconds_of(timeout, None), retry)

    @property
    def address(self) -> str:
        """The server's, with the port."""
        return self._transport.target.address

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self._transport.target.name}>"

    def close(self) -> None:
        """Ends the calls that run (they raise cancelled), and the connection."""
        self._transport.close()

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                        traceback: Optional[TracebackType]) -> None:
        self.close()

    # ---------------------------------------------------------------------------------------------- collections

    def collection(self, name: str = "default") -> Collection:
        """A collection by its name or an alias. Does not ask the server whether there is one."""
        return Collection(self._transport, _named(name))

    def create_collection(self, name: str, *, description: str = "", profile: Optional[types.Profile] = None,
                                unit: Optional[types.Unit] = None, parameters: Optional[types.Parameters] = None,
                                exist_ok: bool = False, timeout: Optional[float] = None) -> Collection:
        """Makes a collection. With a `unit` of length sizes count in its searches. Raises already_exists unless
        `exist_ok`; then the one that is there stays as it is. Not repeated by itself."""
        given = parameters or types.Parameters()
        if unit is not None:
            given = replace(given, unit=unit)
        call = calls.create_collection(_named(name), text_of(description, "description"), profile, given)
        try:
            self._transport.run(call, timeout)
        except ShapeDBError as error:
            if not exist_ok or error.reason != "already_exists":
                raise
        return self.collection(name)

    def collections(self, *, timeout: Optional[float] = None) -> Tuple[types.CollectionInfo, ...]:
        """All collections that the API key may see, by name."""
        return self._transport.run(calls.list_collections(), timeout)

    def rename_collection(self, name: str, new_name: str, *,
                                timeout: Optional[float] = None) -> types.CollectionInfo:
        """Gives a collection another name; its shapes and aliases stay. Not repeated by itself."""
        return self._transport.run(calls.rename_collection(_named(name), _named(new_name)), timeout)

    def delete_collection(self, name: str, *, force: bool = False, timeout: Optional[float] = None) -> None:
        """Deletes a collection. Raises rejected if it has shapes and `force` is not set. Not repeated by itself."""
        self._transport.run(calls.delete_collection(_named(name), force), timeout)

    def set_alias(self, alias: str, collection: str, *, timeout: Optional[float] = None) -> types.CollectionInfo:
        """Makes a name stand for a collection, or for another one than before, at one moment. Returns that
        collection."""
        return self._transport.run(calls.set_alias(_named(alias), _named(collection)), timeout)

    def delete_alias(self, alias: str, *, timeout: Optional[float] = None) -> None:
        """The collection stays. Not repeated by itself."""
        self._transport.run(calls.delete_alias(_named(alias)), timeout)

    def import_collection(self, path: PathLike, name: str = "", *,
                                progress: Showing = False,
                                timeout: Optional[float] = None) -> admin.Imported:
        """Adds the collection of a file that `Collection.export` wrote, under its own name or another. Nothing is
        segmented again. Not repeated by itself, without limit but `timeout`."""
        return self._transport.run(calls.import_collection(path, name, progress), timeout)

    # ------------------------------------------------------------------------------- without storing anything

    def segment(self, scan: Scan, *, profile: Optional[types.Profile] = None,
                      parameters: Optional[types.Parameters] = None, summary_only: bool = False,
                      drop_plane: bool = False, largest_object: bool = False,
                      progress: Showing = False,
                      timeout: Optional[float] = None) -> types.Segmentation:
        """The parts of a scan. With `summary_only` without the points."""
        packed = self._transport.offload(pack, scan)
        return self._transport.run(
            shape_calls.segment(packed, profile=profile, parameters=parameters, summary_only=summary_only,
                                drop_plane=drop_plane, largest_object=largest_object, progress=progress), timeout)

    def align(self, query: Scan, other: Scan, *, reflection: bool = True, keep_scale: bool = False,
                    partial: bool = False, drop_plane: bool = False, largest_object: bool = False,
                    progress: Showing = False, timeout: Optional[float] = None) -> Fit:
        """Lays a scan on another. `fit.motion` leads from the coordinates of `other` to those of `query`. `keep_scale`:
        both have the same unit. `partial`: the query may show one side or a piece of the other."""
        first = self._transport.offload(pack, query)
        second = self._transport.offload(pack, other)
        options = search_calls.CompareOptions(reflection, keep_scale, False, partial)
        return self._transport.run(
            search_calls.align(first, second, options, drop_plane, largest_object, progress), timeout)

    # --------------------------------------------------------------------------------------- the server itself

    def health(self, service: str = "", *, timeout: Optional[float] = None) -> admin.Health:
        """Of one service by its full name ("shapedb.v1.SearchService"), or of the whole server."""
        return self._transport.run(calls.health(service), timeout)

    def stats(self, *, timeout: Optional[float] = None) -> admin.Stats:
        """What the server holds and does."""
        return self._transport.run(calls.stats(), timeout)

    def server_info(self, *, timeout: Optional[float] = None) -> admin.ServerInfo:
        """Its version and limits."""
        return self._transport.run(calls.server_info(), timeout)

    def rebuild(self, *, cache_only: bool = False, detach: bool = False,
                      progress: Optional[Callable[[admin.RebuildProgress], None]] = None,
                      timeout: Optional[float] = None) -> Tuple[admin.RebuildProgress, ...]:
        """Segments the shapes of all collections again, see `Collection.rebuild`."""
        return self._transport.run(calls.rebuild("", cache_only, None, None, detach, progress), timeout)

    def backup(self, path: PathLike, *, since: Optional[PathLike] = None, progress: Showing = False,
                     timeout: Optional[float] = None) -> admin.BackupReport:
        """Writes a consistent copy of everything to a file, which appears complete or not at all. `since`: only what
        has changed since that backup or increment, as a new increment. Without limit but `timeout`."""
        call = self._transport.offload(calls.backup, path, since, progress)
        return self._transport.run(call, timeout)

    def restore(self, path: PathLike, *increments: PathLike, progress: Showing = False,
                      timeout: Optional[float] = None) -> admin.Restored:
        """Replaces everything on the server with a backup: a full one, and increments that continue it, oldest first.
        Not repeated by itself, without limit but `timeout`."""
        call = self._transport.offload(calls.restore, (path, *increments), progress)
        return self._transport.run(call, timeout)

    def check(self, *, acknowledge: bool = False, progress: Showing = False,
                    timeout: Optional[float] = None) -> Tuple[str, ...]:
        """Reads the whole database and returns the problems found; none if it is sound. Without limit but `timeout`.
        With `acknowledge`, acknowledged changes that are missing are not reported again."""
        return self._transport.run(calls.check(progress, acknowledge), timeout)

    def create_key(self, name: str, role: admin.Role, *, collections: Sequence[str] = (),
                         expires: Optional[datetime] = None, limits: admin.KeyLimits = admin.KeyLimits(),
                         timeout: Optional[float] = None) -> admin.CreatedKey:
        """Makes an API key; its secret is told this once. Takes an admin key of all collections, or the server's Unix
        socket. Not repeated by itself."""
        return self._transport.run(calls.create_key(name, role, collections, expires, limits), timeout)

    def keys(self, *, timeout: Optional[float] = None) -> Tuple[admin.Key, ...]:
        """All API keys, the oldest first, those that were revoked or have expired included."""
        return self._transport.run(calls.list_keys(), timeout)

    def revoke_key(self, id: str, *, timeout: Optional[float] = None) -> admin.Key:
        """From the next call on nobody can use the key. Not repeated by itself."""
        return self._transport.run(calls.revoke_key(id), timeout)
