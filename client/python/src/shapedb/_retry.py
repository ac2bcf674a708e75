# SPDX-License-Identifier: Apache-2.0
"""When a failed call is tried again, and how long it may take in all."""

from __future__ import annotations

import math
import random
import time
from dataclasses import dataclass
from typing import Optional

from ._errors import Failure, InvalidInput, ShapeDBError


@dataclass(frozen=True)
class RetryPolicy:
    """When a call that can safely be repeated is tried again.

    Only if the server cannot be reached or its queue is full, never after another error. Before try n the client
    waits `initial_backoff * multiplier ** (n - 2)` seconds, at most `max_backoff`, varied at random by `jitter`; or
    as long as the server asks for. The count starts again when the reason changes.
    """

    max_attempts: int = 5
    """Tries in all while the server cannot be reached; at least 1."""
    max_queue_attempts: int = 5
    """Tries in all while its queue is full; at least 1."""
    initial_backoff: float = 0.1
    multiplier: float = 2.0
    max_backoff: float = 5.0
    jitter: float = 0.2
    """A share, in [0, 1]."""

    def __post_init__(self) -> None:
        for name, low, high in (("max_attempts", 1, math.inf), ("max_queue_attempts", 1, math.inf),
                                ("initial_backoff", 0, math.inf), ("multiplier", 1, math.inf),
                                ("max_backoff", 0, math.inf), ("jitter", 0, 1)):
            value = getattr(self, name)
            if not (low <= value <= high and math.isfinite(value)):
                wanted = f"in [{low}, {high}]" if high < math.inf else f"finite and at least {low}"
                raise InvalidInput("invalid_argument", f"retry.{name} is {value}; it must be {wanted}")

    def delay(self, attempt: int, failure: Failure) -> Optional[float]:
        """Seconds until the next try; None if the failure is final. `attempt` counts the failures in a row for
        this reason, from 1."""
        tries = {"unavailable": self.max_attempts, "queue_full": self.max_queue_attempts}
        if attempt >= tries.get(failure.retry_reason, 1):
            return None
        if failure.pushback is not None:
            # Negative, or not a number: do not retry (gRFC A6).
            return int(failure.pushback) / 1000.0 if failure.pushback.isascii() and failure.pushback.isdigit() \
                else None
        backoff = min(self.max_backoff, self.initial_backoff * self.multiplier**(attempt - 1))
        return backoff * random.uniform(1.0 - self.jitter, 1.0 + self.jitter)


PATIENT = 1_000_000
"""Tries of a bulk upload while the queue is full: it waits for room."""


class Attempts:
    """The tries of one call: counts them and watches the time. Not for several threads."""

    def __init__(self, policy: RetryPolicy, idempotent: bool, seconds: Optional[float]) -> None:
        self._policy = policy
        self._idempotent = idempotent
        self._end = math.inf if seconds is None else time.monotonic() + seconds
        self._in_a_row = 0
        self._reason = ""

    def remaining(self) -> Optional[float]:
        """Seconds left for the call, None without limit."""
        return None if self._end == math.inf else max(0.0, self._end - time.monotonic())

    def after(self, failure: Failure) -> float:
        """Seconds to wait before the next try. Raises the error of a failure that is final."""
        self._in_a_row = self._in_a_row + 1 if failure.retry_reason == self._reason else 1
        self._reason = failure.retry_reason
        delay = self._policy.delay(self._in_a_row, failure) if self._idempotent else None
        if delay is None or time.monotonic() + delay >= self._end:
            raise failure.error
        return delay


def seconds_of(timeout: Optional[float], default: Optional[float]) -> Optional[float]:
    """How long a call may take; None: without limit. `timeout` is the caller's, None for `default`."""
    seconds = default if timeout is None else timeout
    if seconds is None or seconds == math.inf:
        return None
    if not seconds >= 0.0:
        raise InvalidInput("invalid_argument", f"timeout is {seconds}; it must be at least 0 seconds")
    return float(seconds)


def cancelled() -> ShapeDBError:
    """The error of a call that this side gave up."""
    return ShapeDBError("cancelled", "the call was cancelled: its client was closed, or the work was stopped")
