# SPDX-License-Identifier: Apache-2.0
"""One collection, as `AsyncClient` sees it. `_collection.py` is made of this file by scripts/python-sync.py."""

from __future__ import annotations

from typing import (TYPE_CHECKING, Any, AsyncIterator, Callable, Dict, Iterable, List, Mapping, Optional, Sequence,
                    Tuple, Union)

import numpy.typing as npt

from . import _admin_calls as admin_calls
from . import _bulk as bulk
from . import _search_calls as search_calls
from . import _shape_calls as calls
from . import _types as types
from ._admin_types import BackupReport, RebuildProgress
from ._connection import PathLike
from ._errors import InvalidInput, ShapeDBError
from ._points import FloatArray, Packed, Scan, pack
from ._progress import Showing, close, reporter, shown
from ._search_types import Comparison, Fit, Hit, SearchResult
from ._transport import AsyncTransport, Stop
from ._vectors import vector_of
from ._wire import metadata_texts

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POLL_SECONDS = 0.1
_LONGEST_POLL_SECONDS = 2.0


class AsyncCollection:
    """The shapes of one collection. Made by `AsyncClient.collection`, without asking the server whether there is one.

    Every call raises `ShapeDBError`, and takes `timeout`: the most seconds it may take with all its tries, in place of
    the client's; `math.inf` for no limit. progress: True for a bar, or a function that is told (see `Progress`; an
    upload calls it from another thread, and what it raises is logged).
    """

    def __init__(self, transport: AsyncTransport, name: str) -> None:
        self._transport = transport
        self._name = name

    @property
    def name(self) -> str:
        """Its name, or an alias."""
        return self._name

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self._name!r} at {self._transport.target.address}>"

    # --------------------------------------------------------------------------------------------- adding scans

    async def add(self, key: str, scan: Scan, *, metadata: Optional[types.Metadata] = None,
                  mode: types.AddMode = "upsert", expected_version: Optional[int] = None, wait: bool = False,
                  drop_plane: bool = False, largest_object: bool = False,
                  progress: Showing = False, timeout: Optional[float] = None) -> types.Added:
        """Uploads one scan: an (n, 3) array, the path of a file, or an object with `.points` (see `shapedb.Scan`).

        On return the scan is on the server's disk; with `wait` it is segmented too, and searches find it. The same key
        with the same points and metadata is the same shape, so adding it again changes nothing.

        Without `metadata` a shape that has the key keeps what it has; `{}` leaves it none. `drop_plane` leaves out the
        plane that the object stands on, `largest_object` all but the largest of several objects. With
        `expected_version` the shape must have this version now (0: there must be none), and the call is not repeated by
        itself. A call with `wait` has no time limit but `timeout`; the scan stays stored when that passes.
        """
        packed = await self._transport.offload(pack, scan)
        return await self._transport.run(
            calls.add(self._name, key, packed, metadata=metadata, mode=mode, expected_version=expected_version,
                      wait=wait, drop_plane=drop_plane, largest_object=largest_object, progress=progress), timeout)

    async def add_many(self, items: Union[PathLike, Iterable[bulk.AnyItem], Mapping[str, Scan]], *,
                       mode: types.AddMode = "upsert", wait: bool = False, drop_plane: bool = False,
                       largest_object: bool = False, workers: int = 4, resume: bool = True, progress: Showing = None,
                       timeout: Optional[float] = None) -> bulk.BulkResult:
        """Uploads many scans, several at a time: a folder, a mapping of keys to scans, or anything that yields
        (key, scan), (key, scan, metadata) or `shapedb.Item`. Paths are read when their turn comes, a generator is
        asked for a few items at a time.

        Scans that cannot be used do not stop the others: they are in `BulkResult.errors`. What every other scan would
        meet too (no permission, no such collection, server gone, its disk full) ends the call. While the server's
        queue is full it waits.

        After an interruption call it again: with `resume` scans that are there already, with the same points and
        metadata, are not sent again. `timeout` is for each upload, an hour if it is not given. By default a bar shows
        the progress in terminals and notebooks.
        """
        if workers < 1:
            raise InvalidInput("invalid_argument", f"workers is {workers}; it must be at least 1")
        each = bulk.items_of(items)
        ledger = bulk.Ledger(each, progress)
        stop = Stop()
        retry = bulk.patient(self._transport.retry)
        limit = bulk.UPLOAD_SECONDS if timeout is None else timeout

        async def store(item: bulk.Item, packed: Packed) -> None:
            call = calls.add(self._name, item.key, packed, metadata=item.metadata, mode=mode, expected_version=None,
                             wait=wait, drop_plane=drop_plane, largest_object=largest_object, progress=None)
            added = await self._transport.run(call, limit, stop, retry)
            ledger.done(item.key, added.outcome)

        async def work(batch: Sequence[bulk.Item]) -> None:
            # What is left out of a scan changes its points, so that only the server can tell whether they are the same.
            known = await self._known(batch, ledger, stop) if resume and not (drop_plane or largest_object) else {}
            for item in batch:
                if ledger.fatal is not None:
                    return
                try:
                    packed = await self._transport.offload(_packed, item)
                    if item.key in known and _is_stored(known[item.key], item, packed):
                        ledger.done(item.key, "unchanged")
                    else:
                        await store(item, packed)
                except ShapeDBError as error:
                    ledger.failed(item.key, error)

        try:
            await bulk.run_async_workers(bulk.in_batches(each, 16), work, workers, ledger, stop)
        except BaseException:
            ledger.fatal = None  # what interrupts is raised
            ledger.close()
            raise
        return ledger.close()

    async def _known(self, batch: Sequence[bulk.Item], ledger: bulk.Ledger, stop: Stop) -> Dict[str, Any]:
        """The shapes that have these keys already."""
        try:
            call = calls.get_messages(self._name, [item.key for item in batch])
            found = await self._transport.run(call, None, stop)
        except ShapeDBError as error:
            if error.reason == "invalid_argument":
                return {}  # a key that cannot be: its upload will say so
            ledger.failed(batch[0].key, error)
            return {}
        return {shape.key: shape for shape in found.shapes}

    async def wait(self, key: str, *, progress: Optional[Callable[[types.IngestEvent], None]] = None,
                   timeout: Optional[float] = None) -> types.IngestEvent:
        """Follows a shape until it is ready or failed, and returns the last event. `progress` is told all of them.
        Without limit but `timeout`."""
        return await self._transport.run(calls.watch(self._name, key, progress), timeout)

    async def wait_until_ready(self, *, progress: Showing = None,
                               timeout: Optional[float] = None) -> types.CollectionInfo:
        """Waits until no shape of the collection is pending, and returns how many are ready and failed. Without limit
        but `timeout`. By default a bar shows the progress in terminals and notebooks."""
        listener = shown(progress)
        left = timeout
        pause = _POLL_SECONDS
        try:
            while True:
                info = await self.info()
                if listener is not None:
                    listener(types.Progress("segment", info.ready + info.failed, info.shapes))
                if info.pending == 0:
                    return info
                if left is not None:
                    if left <= 0.0:
                        raise ShapeDBError("deadline_exceeded",
                                           f"{info.pending} shapes of '{self._name}' are still pending")
                    pause = min(pause, left)
                    left -= pause
                await self._transport.sleep(pause)
                pause = min(2.0 * pause, _LONGEST_POLL_SECONDS)
        finally:
            close(listener)

    # ------------------------------------------------------------------------------------------- reading shapes

    async def get(self, key: str, *, timeout: Optional[float] = None) -> types.Shape:
        """One shape. Raises not_found."""
        return await self._transport.run(calls.get(self._name, key), timeout)

    async def exists(self, key: str, *, timeout: Optional[float] = None) -> bool:
        """Whether a shape has the key."""
        found = await self._transport.run(calls.get_many(self._name, [key]), timeout)
        return bool(found.shapes)

    async def get_many(self, keys: Sequence[str], *, timeout: Optional[float] = None) -> types.Found:
        """Shapes by their keys, in that order, and the keys that no shape has."""
        shapes: List[types.Shape] = []
        missing: List[str] = []
        for batch in calls.batches(keys):
            found = await self._transport.run(calls.get_many(self._name, batch), timeout)
            shapes += found.shapes
            missing += found.missing
        return types.Found(tuple(shapes), tuple(missing))

    async def points(self, key: str, *, timeout: Optional[float] = None) -> FloatArray:
        """The points of a shape as they are stored, in the coordinates of the scan: (n, 3), float64 with the precision
        of float32."""
        return await self._transport.run(calls.points(self._name, key), timeout)

    async def shapes(self, *, filter: str = "", state: Optional[types.State] = None, order: types.Order = "id",
                     descending: bool = False, key_prefix: str = "", page_size: int = 0,
                     timeout: Optional[float] = None) -> AsyncIterator[types.Shape]:
        """All shapes that pass a filter (docs/filters.md), page after page as they are asked for. `timeout` is for each
        page. By id and by key the listing is stable while others insert and delete."""
        cursor = ""
        while True:
            page = await self.page(filter=filter, state=state, order=order, descending=descending,
                                   key_prefix=key_prefix, page_size=page_size, cursor=cursor, timeout=timeout)
            for shape in page.shapes:
                yield shape
            cursor = page.next_cursor
            if not cursor:
                return

    async def page(self, *, filter: str = "", state: Optional[types.State] = None, order: types.Order = "id",
                   descending: bool = False, key_prefix: str = "", page_size: int = 0, cursor: str = "",
                   timeout: Optional[float] = None) -> types.Page:
        """One page of `shapes`: up to `page_size` (1 to 1,000; 0: 100), after the one that gave `cursor`."""
        return await self._transport.run(
            calls.page(self._name, filter=filter, state=state, order=order, descending=descending,
                       key_prefix=key_prefix, page_size=page_size, cursor=cursor), timeout)

    async def count(self, *, filter: str = "", state: Optional[types.State] = None, key_prefix: str = "",
                    timeout: Optional[float] = None) -> int:
        """How many shapes `shapes` would yield."""
        return await self._transport.run(calls.count(self._name, filter, state, key_prefix), timeout)

    async def count_by_value(self, metadata_key: str, *, filter: str = "", state: Optional[types.State] = None,
                             max_values: int = 0, timeout: Optional[float] = None) -> types.ValueCounts:
        """How many shapes have which value under a metadata key; at most `max_values` are named (up to 1,000; 0:
        100)."""
        return await self._transport.run(
            calls.count_by_value(self._name, metadata_key, filter, state, max_values), timeout)

    async def previews(self, keys: Sequence[str], *, max_points: int = 0,
                       timeout: Optional[float] = None) -> Tuple[types.Preview, ...]:
        """Some points of each of up to 1,000 shapes, enough for a small picture: at most `max_points` of each (0: as
        many as there are, up to 1,500). In the order of the keys, without those that no shape has. No scan is read."""
        return await self._transport.run(calls.previews(self._name, keys, max_points), timeout)

    async def signature(self, key: str, *, timeout: Optional[float] = None) -> types.Signature:
        """The signature that searches use now. Raises not_found, not_ready."""
        return await self._transport.run(calls.signature(self._name, key), timeout)

    async def segments(self, key: str, *, timeout: Optional[float] = None) -> types.Segmentation:
        """The stored points with their segments; they are segmented again for it."""
        return await self._transport.run(calls.segments(self._name, key), timeout)

    # ------------------------------------------------------------------------------------------ changing shapes

    async def update_metadata(self, key: str, put: Optional[types.Metadata] = None, *, remove: Sequence[str] = (),
                              replace_all: bool = False, expected_version: Optional[int] = None,
                              timeout: Optional[float] = None) -> types.MetadataUpdate:
        """Changes the metadata of one shape, and nothing else: `put` replaces what it has under these keys, `remove`
        takes keys away, `replace_all` leaves only `put`."""
        return await self._transport.run(
            calls.update_metadata(self._name, key, None, put, remove, replace_all, expected_version), timeout)

    async def update_metadata_where(self, filter: str, put: Optional[types.Metadata] = None, *,
                                    remove: Sequence[str] = (), replace_all: bool = False,
                                    timeout: Optional[float] = None) -> types.MetadataUpdate:
        """The same for all shapes that pass a filter ("": all of the collection), some at a time: what was changed
        before an error stays changed. Not repeated by itself, without limit but `timeout`."""
        return await self._transport.run(
            calls.update_metadata(self._name, None, filter, put, remove, replace_all, None), timeout)

    async def delete(self, key: str, *, expected_version: Optional[int] = None,
                     timeout: Optional[float] = None) -> types.Shape:
        """Deletes a shape with its points, and returns what it was. Not repeated by itself. Raises not_found,
        version_conflict."""
        return await self._transport.run(calls.delete(self._name, key, expected_version), timeout)

    async def delete_many(self, keys: Optional[Sequence[str]] = None, *, filter: Optional[str] = None,
                          timeout: Optional[float] = None) -> types.Deleted:
        """Deletes shapes by their keys (up to 1,000), or all that pass a filter ("": all of the collection), some at a
        time: what was deleted before an error stays deleted. Not repeated by itself, without limit but `timeout`."""
        return await self._transport.run(calls.delete_many(self._name, keys, filter), timeout)

    async def retry(self, keys: Optional[Sequence[str]] = None, *, filter: Optional[str] = None,
                    timeout: Optional[float] = None) -> types.Retried:
        """Segments failed shapes again: by their keys (up to 1,000), or all failed ones that pass a filter."""
        return await self._transport.run(calls.retry(self._name, keys, filter), timeout)

    # ------------------------------------------------------------------------------------------------ searching

    async def search(self, query: Union[Scan, types.Signature, None] = None, *, key: Optional[str] = None, k: int = 10,
                     threshold: float = 0.0, filter: str = "", reflection: bool = True, keep_scale: bool = False,
                     free_scale: bool = False, partial: bool = False, explain: bool = True,
                     verify: Optional[bool] = None, candidates: int = 0, one_sided: Optional[bool] = None,
                     viewpoint: Optional[npt.ArrayLike] = None, group_by: Optional[str] = None, per_group: int = 0,
                     at_least: int = 0, allow_partial: bool = False, include_self: bool = False,
                     drop_plane: bool = False, largest_object: bool = False, progress: Showing = False,
                     timeout: Optional[float] = None) -> SearchResult:
        """The k shapes most like a scan (as in `add`; it is not stored), like a `Signature`, or like the stored shape
        that has `key`.

        threshold: the lowest score of a hit. filter: on metadata (docs/filters.md), applied first. reflection: mirror
        images count as alike. keep_scale: sizes count, as they do anyway in a collection with a unit unless free_scale.
        partial: the query may be a scan of one side or a broken piece; the score says how much of it the hit contains.
        explain: send motions and explanations. verify: lay the best candidates on the query (by default, but not with
        profile "paper"), `candidates` of them at most (0: as many as the server thinks right). one_sided: a camera saw
        the query from one place (None: judged), which was at `viewpoint`. group_by: a metadata key; the k groups of
        shapes with the same value whose best hits are best, `per_group` hits of each (0: 1). at_least: a
        `Shape.change` that the answer must know, where several servers share a database; raises unavailable if the one
        that is asked does not hear of it in time. allow_partial: where several servers hold parts of the collection and
        some are missing, answer without them (`SearchResult.covered`) in place of unavailable. include_self: with
        `key`, keep that shape among the hits.
        """
        if (query is None) == (key is None):
            raise InvalidInput("invalid_argument", "search for either a scan or signature, or key=...")
        options = search_calls.Options(k, threshold, filter, reflection, keep_scale, free_scale, partial, explain,
                                       verify, candidates, one_sided, viewpoint, group_by, per_group, at_least,
                                       allow_partial)
        if key is not None:
            return await self._transport.run(search_calls.by_key(self._name, options, key, include_self), timeout)
        if isinstance(query, types.Signature):
            return await self._transport.run(search_calls.by_signature(self._name, options, query), timeout)
        packed = await self._transport.offload(pack, query)
        return await self._transport.run(
            search_calls.by_scan(self._name, options, packed, drop_plane, largest_object, progress), timeout)

    async def search_batch(self, queries: Sequence[Union[str, types.Signature]], *, k: int = 10,
                           threshold: float = 0.0, filter: str = "", reflection: bool = True, keep_scale: bool = False,
                           free_scale: bool = False, partial: bool = False, explain: bool = False,
                           verify: Optional[bool] = None, candidates: int = 0, group_by: Optional[str] = None,
                           per_group: int = 0, at_least: int = 0, allow_partial: bool = False,
                           progress: Showing = False, timeout: Optional[float] = None) -> Tuple[SearchResult, ...]:
        """Searches for many stored shapes (by key) and signatures, with the same options, which are those of `search`;
        motions and explanations only with `explain`. The results are in the order of the queries; the first error ends
        it. It takes a call for each 25 of them, which `timeout` is for."""
        options = search_calls.Options(k, threshold, filter, reflection, keep_scale, free_scale, partial, explain,
                                       verify, candidates, None, None, group_by, per_group, at_least, allow_partial)
        report = reporter(progress, "search")
        results: List[SearchResult] = []
        for batch in search_calls.query_batches(queries):
            found = await self._transport.run(search_calls.batch(self._name, options, batch), timeout)
            results += found
            report(len(results), len(queries))
        return tuple(results)

    async def compare(self, key: str, other: str, *, other_collection: Optional[str] = None, reflection: bool = True,
                      keep_scale: bool = False, free_scale: bool = False, partial: bool = False,
                      timeout: Optional[float] = None) -> Comparison:
        """How alike two stored shapes are, and why; `other` may be in another collection. With `partial`: how much of
        the first the other contains."""
        options = search_calls.CompareOptions(reflection, keep_scale, free_scale, partial)
        return await self._transport.run(
            search_calls.compare((self._name, key), (other_collection or self._name, other), options), timeout)

    async def align(self, scan: Scan, key: str, *, reflection: bool = True, keep_scale: bool = False,
                    free_scale: bool = False, partial: bool = False, drop_plane: bool = False,
                    largest_object: bool = False, progress: Showing = False,
                    timeout: Optional[float] = None) -> Fit:
        """Lays a stored shape on a scan, which is not stored. `fit.motion` leads from the shape's coordinates to the
        scan's. With `partial` the scan may show one side or a piece."""
        packed = await self._transport.offload(pack, scan)
        options = search_calls.CompareOptions(reflection, keep_scale, free_scale, partial)
        return await self._transport.run(
            search_calls.align(packed, (self._name, key), options, drop_plane, largest_object, progress), timeout)

    async def show(self, query: Scan, hit: Union[Hit, str], *, ax: Optional["Axes"] = None, max_points: int = 4000,
                   timeout: Optional[float] = None) -> "Axes":
        """Draws a scan and a stored shape laid on it, with matplotlib: a hit of a search with the motion it has, or a
        key, which is aligned first."""
        from ._show import show
        if isinstance(hit, str):
            motion = (await self.align(query, hit, timeout=timeout)).motion
            key = hit
        else:
            if hit.motion is None:
                raise InvalidInput("invalid_argument", "the hit has no motion: search with explain=True")
            motion, key = hit.motion, hit.key
        points = await self.points(key, timeout=timeout)
        return show(query, (points, motion), names=["query", key], ax=ax, max_points=max_points)

    # ------------------------------------------------------------------------------------------- the collection

    async def info(self, *, timeout: Optional[float] = None) -> types.CollectionInfo:
        """What the collection is and holds. Raises not_found."""
        return await self._transport.run(admin_calls.get_collection(self._name), timeout)

    async def drop(self, *, force: bool = False, timeout: Optional[float] = None) -> None:
        """Deletes the collection. Raises rejected if it has shapes and `force` is not set. Not repeated by itself."""
        await self._transport.run(admin_calls.delete_collection(self._name, force), timeout)

    async def rebuild(self, *, profile: Optional[types.Profile] = None, parameters: Optional[types.Parameters] = None,
                      cache_only: bool = False, detach: bool = False,
                      progress: Optional[Callable[[RebuildProgress], None]] = None,
                      timeout: Optional[float] = None) -> Tuple[RebuildProgress, ...]:
        """Segments all shapes again, with new parameters if some are given, and follows that to its end. It survives
        the loss of this call, and calling again follows it. `cache_only` reloads the stored signatures and no more,
        `detach` returns at once. Without limit but `timeout`."""
        return await self._transport.run(
            admin_calls.rebuild(self._name, cache_only, profile, parameters, detach, progress), timeout)

    async def cancel_rebuild(self, *, timeout: Optional[float] = None) -> None:
        """Stops a running rebuild and discards what it has made. Raises not_found."""
        await self._transport.run(admin_calls.cancel_rebuild(self._name), timeout)

    async def export(self, path: PathLike, *, progress: Showing = False,
                     timeout: Optional[float] = None) -> BackupReport:
        """Writes the collection to a file, which appears complete or not at all; `AsyncClient.import_collection` reads
        it. Without limit but `timeout`."""
        return await self._transport.run(admin_calls.export(self._name, path, progress), timeout)


def _packed(item: bulk.Item) -> Packed:
    return pack(item.scan() if callable(item.scan) else item.scan)


def _is_stored(shape: Any, item: bulk.Item, packed: Packed) -> bool:
    """Whether adding the item would change nothing."""
    if shape.sha256 != packed.sha256 or (vector_of(shape.origin) != packed.origin).any() or shape.HasField("failure"):
        return False
    if item.metadata is None:
        return True
    stored = {key: value for key, value in shape.metadata.items() if not key.startswith("shapedb.")}
    return stored == metadata_texts(item.metadata)
