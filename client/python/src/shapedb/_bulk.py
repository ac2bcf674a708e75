# SPDX-License-Identifier: Apache-2.0
"""Many uploads: what is to be sent, what became of it, and the workers that do it."""

from __future__ import annotations

import asyncio
import os
import threading
from collections import Counter
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import (Any, Awaitable, Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Sized, Tuple,
                    Union)

from ._connection import PathLike
from ._errors import InvalidInput, ShapeDBError
from ._files import ENDINGS, is_scan_file, without_ending
from ._points import Scan
from ._progress import Showing, close, shown
from ._retry import PATIENT, RetryPolicy
from ._transport import Stop
from ._types import Metadata, Outcome, Progress


@dataclass(frozen=True, eq=False)
class Item:
    """One scan of many. `scan` may be a path, which is read when its turn comes, or a function that returns a scan."""

    key: str
    scan: Union[Scan, Callable[[], Scan]] = field(repr=False)
    metadata: Optional[Metadata] = None


AnyItem = Union[Item, Tuple[str, Scan], Tuple[str, Scan, Metadata]]


@dataclass(frozen=True)
class BulkResult:
    """What became of many uploads."""

    outcomes: Dict[str, Outcome] = field(repr=False, hash=False)
    """By key, of those that were stored; "unchanged" also of those that were there already and not sent again."""
    errors: Dict[str, ShapeDBError] = field(hash=False)
    """By key, of those that were not."""

    def __len__(self) -> int:
        return len(self.outcomes)

    def count(self, outcome: Outcome) -> int:
        """How many had this outcome."""
        return sum(one == outcome for one in self.outcomes.values())

    def raise_for_errors(self) -> "BulkResult":
        """Raises the first error, if there is one."""
        for key, error in self.errors.items():
            others = f" (and {len(self.errors) - 1} others failed)" if len(self.errors) > 1 else ""
            raise ShapeDBError(error.reason, f"'{key}': {error.message}{others}")
        return self


UPLOAD_SECONDS = 3600.0
"""What one of many uploads may take, waiting for room in the queue included."""

# What the next upload would meet too.
_FATAL = frozenset(("unauthenticated", "permission_denied", "unavailable", "not_found", "storage_full", "storage",
                    "cancelled", "rate_limited"))


def patient(policy: RetryPolicy) -> RetryPolicy:
    """The same, but it waits as long as the queue is full."""
    return replace(policy, max_queue_attempts=PATIENT)


def scan_folder(folder: PathLike, *, label_from_folder: bool = False,
                metadata: Optional[Callable[[Path], Metadata]] = None) -> List[Item]:
    """The scan files in and below a folder as items for `Collection.add_many`, sorted by path.

    The key is the path below the folder without its ending, which stays where files of a folder differ in nothing else
    (box.stl and box.obj). With `label_from_folder` the name of a file's folder
    becomes the metadata "label"; `metadata`, a function of the path, may give others. Hidden files are left out, links
    to folders are not followed, and a .txt file counts only if its first line looks like a point. Files that this
    package cannot read (.pcd, .off, ...) are left out too; `shapedb add` or trimesh reads those.
    """
    root = Path(folder)
    if not root.is_dir():
        raise ShapeDBError("file_not_readable", f"{root} is not a folder that can be read")
    found: List[Tuple[Path, Optional[Metadata]]] = []
    for base, folders, files in os.walk(root):
        folders[:] = [name for name in folders if not name.startswith(".")]
        for name in files:
            path = Path(base, name)
            if name.startswith(".") or not is_scan_file(path):
                continue
            given: Dict[str, Union[str, int, float]] = {"label": path.parent.name} if label_from_folder else {}
            if metadata is not None:
                given.update(metadata(path))
            found.append((path, given or None))
    if not found:
        raise ShapeDBError("file_not_readable", f"{root} has no scan file ({', '.join(sorted(ENDINGS))})")
    alike = Counter(without_ending(path) for path, _ in found)
    items = []
    for path, given_metadata in found:
        named = path if alike[without_ending(path)] > 1 else without_ending(path)
        items.append(Item(named.relative_to(root).as_posix(), path, given_metadata))
    items.sort(key=lambda item: item.key)
    for one, next_one in zip(items, items[1:]):
        if one.key == next_one.key:
            raise InvalidInput("invalid_argument",
                               f"{one.scan!r} and {next_one.scan!r} would have the same key; rename one")
    return items


def items_of(items: Union[PathLike, Iterable[AnyItem], Mapping[str, Scan]]) -> Iterable[Item]:
    """What may be given to `add_many`, one item after the other."""
    if isinstance(items, (str, os.PathLike)):
        return scan_folder(items)
    if isinstance(items, Mapping):
        return [Item(key, scan) for key, scan in items.items()]
    if isinstance(items, Sized):
        return [_item_of(item) for item in items]
    return (_item_of(item) for item in items)


def _item_of(item: AnyItem) -> Item:
    if isinstance(item, Item):
        return item
    if isinstance(item, tuple) and len(item) in (2, 3) and isinstance(item[0], str):
        return Item(*item)
    raise InvalidInput("invalid_argument",
                       f"an item is (key, scan), (key, scan, metadata) or shapedb.Item, not {type(item).__name__}")


class Ledger:
    """Counts what becomes of the items. For any number of threads."""

    def __init__(self, items: Iterable[Item], showing: Showing, stage: str = "add") -> None:
        self._lock = threading.Lock()
        self._outcomes: Dict[str, Outcome] = {}
        self._errors: Dict[str, ShapeDBError] = {}
        self._total = len(items) if isinstance(items, Sized) else 0
        self._listener = shown(showing)
        self._stage = stage
        self.fatal: Optional[ShapeDBError] = None

    def done(self, key: str, outcome: Outcome) -> None:
        """An item is stored."""
        with self._lock:
            self._outcomes[key] = outcome
            self._tell()

    def failed(self, key: str, error: ShapeDBError) -> None:
        """An item is not."""
        with self._lock:
            self._errors[key] = error
            if error.reason in _FATAL and self.fatal is None:
                self.fatal = ShapeDBError(error.reason, f"'{key}': {error.message}")
            self._tell()

    def _tell(self) -> None:
        if self._listener is not None:
            self._listener(Progress(self._stage, len(self._outcomes) + len(self._errors), self._total))

    def close(self) -> BulkResult:
        """The result. Raises the error that stopped it, if one did."""
        close(self._listener)
        if self.fatal is not None:
            stored = len(self._outcomes)
            raise ShapeDBError(self.fatal.reason,
                               f"{self.fatal.message} ({stored} were stored before; call again for the others)")
        return BulkResult(dict(self._outcomes), dict(self._errors))


def run_workers(batches: Iterator[Sequence[Item]], work: Callable[[Sequence[Item]], None], workers: int,
                ledger: Ledger, stop: Stop) -> None:
    """Does the work in threads. An exception here, Ctrl-C among them, cancels what runs and is raised when the threads
    have ended."""
    with ThreadPoolExecutor(max_workers=workers, thread_name_prefix="shapedb-add") as pool:
        running: List[Future[None]] = []
        try:
            for batch in batches:
                if ledger.fatal is not None:
                    break
                running.append(pool.submit(work, batch))
                if len(running) > workers:
                    running = _still(running, wait(running, return_when=FIRST_COMPLETED).done)
            _still(running, wait(running).done)
        except BaseException:
            stop.stop()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _still(running: List["Future[None]"], done: Any) -> List["Future[None]"]:
    for one in done:
        one.result()  # raises what is not an error of an item
    return [one for one in running if one not in done]


async def run_async_workers(batches: Iterator[Sequence[Item]], work: Callable[[Sequence[Item]], Awaitable[None]],
                            workers: int, ledger: Ledger, stop: Stop) -> None:
    """Does the work in tasks, which end when this one is cancelled."""
    del stop

    async def worker() -> None:
        for batch in batches:  # shared: each batch goes to one worker
            if ledger.fatal is not None:
                return
            await work(batch)

    tasks = [asyncio.create_task(worker()) for _ in range(workers)]
    try:
        await asyncio.gather(*tasks)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def in_batches(items: Iterable[Item], size: int) -> Iterator[List[Item]]:
    """Items in pieces, as they come."""
    batch: List[Item] = []
    for item in items:
        batch.append(item)
        if len(batch) == size:
            yield batch
            batch = []
    if batch:
        yield batch
