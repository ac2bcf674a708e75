# SPDX-License-Identifier: Apache-2.0
"""A progress bar for terminals and notebooks."""

from __future__ import annotations

import logging
import sys
import threading
import time
from typing import Callable, Optional, TextIO, Union

from ._types import Progress

Showing = Union[bool, None, Callable[[Progress], None]]
"""Whether to show a bar on stderr: True, False, None (if stderr is a terminal or this is a notebook); or a function
that is told instead."""

_log = logging.getLogger("shapedb")
_WIDTH = 30
_SECONDS_BETWEEN = 0.1


class Bar:
    """Draws itself on one line, at most ten times a second. For any number of threads."""

    def __init__(self, file: Optional[TextIO] = None) -> None:
        self._file = file or sys.stderr
        self._lock = threading.Lock()
        self._start = time.monotonic()
        self._next = 0.0
        self._last = ""

    def __call__(self, progress: Progress) -> None:
        with self._lock:
            now = time.monotonic()
            if now < self._next and progress.done != progress.total:
                return
            self._next = now + _SECONDS_BETWEEN
            self._draw(line(progress, now - self._start))

    def _draw(self, text: str) -> None:
        self._file.write("\r" + text.ljust(len(self._last)))
        self._file.flush()
        self._last = text

    def close(self) -> None:
        """Ends the line."""
        with self._lock:
            if self._last:
                self._file.write("\n")
                self._file.flush()
                self._last = ""


def line(progress: Progress, seconds: float) -> str:
    """"add  [####    ] 12/40  3.1/s  9 s left"."""
    rate = progress.done / seconds if seconds > 0 else 0.0
    if progress.total <= 0:
        return f"{progress.stage}  {progress.done}  {rate:.3g}/s"
    filled = min(_WIDTH, _WIDTH * progress.done // progress.total)
    text = f"{progress.stage}  [{'#' * filled}{' ' * (_WIDTH - filled)}] {progress.done}/{progress.total}"
    if rate > 0 and progress.done < progress.total:
        text += f"  {rate:.3g}/s  {(progress.total - progress.done) / rate:.0f} s left"
    return text


def shown(showing: Showing) -> Optional[Callable[[Progress], None]]:
    """Who is told: a new `Bar`, the caller's function, or nobody."""
    if callable(showing):
        return showing
    if showing is None:
        # ipykernel's stderr is no terminal, but shows a line that is written again.
        showing = sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules)
    return Bar() if showing else None


def reporter(showing: Showing, stage: str) -> Callable[[int, int], None]:
    """Tells who is to be told how much is done of how much. What a listener raises is logged: in the middle of a
    stream it would look like a failure of gRPC."""
    listener = shown(showing)

    def report(done: int, total: int) -> None:
        if listener is None:
            return
        try:
            listener(Progress(stage, done, total))
        except Exception:
            _log.exception("a progress listener failed")
        if done == total:
            close(listener)

    return report


def close(listener: Optional[Callable[[Progress], None]]) -> None:
    """Ends the line of a bar."""
    if isinstance(listener, Bar):
        listener.close()
