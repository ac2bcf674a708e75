# SPDX-License-Identifier: Apache-2.0
"""A call as a value: what is asked, and what the answer means. Both clients make the same calls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Generic, Iterator, Optional, TypeVar

from ._errors import ShapeDBError

T = TypeVar("T")


class Collector(Generic[T]):
    """Takes the messages of a streamed answer one after the other."""

    def take(self, message: Any) -> None:
        """The next message. Raises `ShapeDBError` if it makes no sense; the call ends then."""
        raise NotImplementedError

    def result(self) -> T:
        """What they come to; called once, after the last."""
        raise NotImplementedError

    def abandon(self) -> None:
        """The call has failed; nothing is to be left of it."""


class Upload(Iterator[Any]):
    """The messages of an upload. A `ShapeDBError` in making them, as of a damaged file, ends the upload early, which no
    server takes for whole; gRPC would say of it that it is internal."""

    def __init__(self, messages: Iterator[Any]) -> None:
        self._messages = messages
        self.error: Optional[ShapeDBError] = None

    def __next__(self) -> Any:
        try:
            return next(self._messages)
        except ShapeDBError as error:
            self.error = error
            raise StopIteration from None


def raise_error_of(requests: Any) -> None:
    """The error that ended an upload early, if there is one."""
    if isinstance(requests, Upload) and requests.error is not None:
        raise requests.error


@dataclass(frozen=True)
class Call(Generic[T]):
    """One rpc, which can be made several times.

    The answer is one message, which `decode` turns into the result, or a stream for a new collector of `collect`.
    """

    rpc: str
    """Service and method: "ShapeService/AddShape"."""
    request: Any
    """A message; or a function that makes an iterator of the messages of an upload, anew for each try."""
    decode: Optional[Callable[[Any], T]] = None
    collect: Optional[Callable[[], Collector[T]]] = None
    idempotent: bool = True
    """May be repeated if it is not known whether it took effect."""
    bounded: bool = True
    """The client's time limit applies; otherwise only the caller's."""

    def requests(self) -> Any:
        """What is handed to gRPC: a message, or an `Upload`."""
        return Upload(self.request()) if callable(self.request) else self.request


class Last(Collector[T]):
    """Keeps the last of several messages, and tells a listener all of them."""

    def __init__(self, decode: Callable[[Any], T], listen: Optional[Callable[[T], None]]) -> None:
        self._decode = decode
        self._listen = listen
        self._last: Optional[T] = None

    def take(self, message: Any) -> None:
        self._last = self._decode(message)
        if self._listen is not None:
            self._listen(self._last)

    def result(self) -> T:
        if self._last is None:
            raise ShapeDBError("malformed_stream", "the server ended its answer without a message")
        return self._last
