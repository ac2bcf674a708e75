# SPDX-License-Identifier: Apache-2.0
"""Makes calls: tries, waits, retries. One class blocks, the other is for asyncio; what they decide is in `_retry`."""

from __future__ import annotations

import asyncio
import threading
import time
from typing import Any, Callable, Dict, Optional, Sequence, Set, TypeVar

import grpc
import grpc.aio

from shapedb.v1 import (admin_service_pb2_grpc, align_service_pb2_grpc, collection_service_pb2,
                        collection_service_pb2_grpc, search_service_pb2_grpc, shape_service_pb2, shape_service_pb2_grpc)

from ._call import Call, raise_error_of
from ._connection import Target
from ._errors import Failure
from ._retry import Attempts, RetryPolicy, cancelled, seconds_of

T = TypeVar("T")

# The messages of grpc.health.v1 have the same bytes as these of ours: one text, one number.
_HEALTH_CHECK = ("/grpc.health.v1.Health/Check", collection_service_pb2.GetCollectionRequest.SerializeToString,
                 shape_service_pb2.CountShapesResponse.FromString)


# Written by protoc, without types.
_STUBS: Dict[str, Any] = {
    "ShapeService": shape_service_pb2_grpc.ShapeServiceStub,
    "SearchService": search_service_pb2_grpc.SearchServiceStub,
    "AlignService": align_service_pb2_grpc.AlignServiceStub,
    "CollectionService": collection_service_pb2_grpc.CollectionServiceStub,
    "AdminService": admin_service_pb2_grpc.AdminServiceStub,
}


def _methods(channel: Any) -> Callable[[str], Any]:
    """Finds the method of an rpc by its name."""
    stubs = {name: make(channel) for name, make in _STUBS.items()}
    path, serialize, deserialize = _HEALTH_CHECK
    health = channel.unary_unary(path, request_serializer=serialize, response_deserializer=deserialize)

    def find(rpc: str) -> Any:
        service, method = rpc.split("/")
        return health if service == "Health" else getattr(stubs[service], method)

    return find


class Stop:
    """Cancels the calls that are made with it, now and later. For any number of threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._calls: Set[Any] = set()
        self._stopped = False

    def stop(self) -> None:
        """Cancels."""
        with self._lock:
            self._stopped = True
            calls = list(self._calls)
        for call in calls:
            call.cancel()

    @property
    def stopped(self) -> bool:
        """Whether it was."""
        return self._stopped

    def enter(self, call: Any) -> None:
        """A call begins."""
        with self._lock:
            self._calls.add(call)
            stopped = self._stopped
        if stopped:
            call.cancel()

    def leave(self, call: Any) -> None:
        """A call is over."""
        with self._lock:
            self._calls.discard(call)


class Transport:
    """A connection that blocks; opened when first needed, reopened when lost. For any number of threads."""

    def __init__(self, target: Target, timeout: Optional[float], retry: RetryPolicy) -> None:
        self.target = target
        self.retry = retry
        self._timeout = timeout
        self._stop = Stop()
        if target.credentials is None:
            self._channel = grpc.insecure_channel(target.address, options=target.options)
        else:
            self._channel = grpc.secure_channel(target.address, target.credentials, options=target.options)
        self._find = _methods(self._channel)

    def run(self, call: Call[T], timeout: Optional[float] = None, stop: Optional[Stop] = None,
            retry: Optional[RetryPolicy] = None) -> T:
        """Makes a call, with retries. Raises `ShapeDBError`. An exception of any other kind, Ctrl-C among them, ends
        the call on the server too."""
        attempts = Attempts(retry or self.retry, call.idempotent,
                            seconds_of(timeout, self._timeout if call.bounded else None))
        stops = [self._stop] if stop is None else [self._stop, stop]
        while True:
            try:
                return self._attempt(call, attempts.remaining(), stops)
            except (grpc.FutureCancelledError, grpc.RpcError, ValueError) as error:
                # The ValueError is that of a closed channel.
                if any(one.stopped for one in stops):
                    raise cancelled() from None
                if not isinstance(error, grpc.RpcError):
                    raise
                delay = attempts.after(Failure(error, self.target.address, self.target.credentials is not None))
            self.sleep(delay)

    def _attempt(self, call: Call[T], timeout: Optional[float], stops: Sequence[Stop]) -> T:
        method = self._find(call.rpc)
        if call.collect is None:
            method = method.future
        requests = call.requests()
        rpc = method(requests, timeout=timeout, metadata=self.target.metadata)
        for stop in stops:
            stop.enter(rpc)
        try:
            if call.collect is None:
                assert call.decode is not None
                return call.decode(rpc.result())
            collector = call.collect()
            try:
                for message in rpc:
                    collector.take(message)
                return collector.result()
            except BaseException:
                collector.abandon()
                raise
        except BaseException:
            rpc.cancel()
            raise_error_of(requests)
            raise
        finally:
            for stop in stops:
                stop.leave(rpc)

    def sleep(self, seconds: float) -> None:
        """Waits."""
        time.sleep(seconds)

    def offload(self, function: Callable[..., T], *arguments: Any) -> T:
        """Runs what computes or reads files."""
        return function(*arguments)

    def close(self) -> None:
        """Ends the calls that run, and the connection."""
        self._stop.stop()
        self._channel.close()


class AsyncTransport:
    """The same for asyncio. Belongs to the event loop that runs when it is first used."""

    def __init__(self, target: Target, timeout: Optional[float], retry: RetryPolicy) -> None:
        self.target = target
        self.retry = retry
        self._timeout = timeout
        self._channel: Optional[Any] = None
        self._closed = False

    def _method(self, rpc: str) -> Any:
        if self._closed:
            raise cancelled()
        if self._channel is None:  # not before: it takes the loop that runs now
            target = self.target
            self._channel = (grpc.aio.insecure_channel(target.address, options=target.options)
                             if target.credentials is None else grpc.aio.secure_channel(
                                 target.address, target.credentials, options=target.options))
            self._find = _methods(self._channel)
        return self._find(rpc)

    async def run(self, call: Call[T], timeout: Optional[float] = None, stop: Optional[Stop] = None,
                  retry: Optional[RetryPolicy] = None) -> T:
        """Makes a call, with retries. Raises `ShapeDBError`. Cancelling the task ends the call on the server too."""
        attempts = Attempts(retry or self.retry, call.idempotent,
                            seconds_of(timeout, self._timeout if call.bounded else None))
        while True:
            try:
                return await self._attempt(call, attempts.remaining())
            except grpc.aio.UsageError:
                raise cancelled() from None
            except grpc.RpcError as error:
                if self._closed:
                    raise cancelled() from None
                delay = attempts.after(Failure(error, self.target.address, self.target.credentials is not None))
            await self.sleep(delay)

    async def _attempt(self, call: Call[T], timeout: Optional[float]) -> T:
        requests = call.requests()
        rpc = self._method(call.rpc)(requests, timeout=timeout, metadata=self.target.metadata)
        try:
            if call.collect is None:
                assert call.decode is not None
                return call.decode(await rpc)
            collector = call.collect()
            try:
                async for message in rpc:
                    collector.take(message)
                return collector.result()
            except BaseException:
                collector.abandon()
                raise
        except asyncio.CancelledError:
            if self._closed:  # by close(), not by a cancellation of this task
                raise cancelled() from None
            raise
        except grpc.RpcError:
            raise_error_of(requests)
            raise
        finally:
            rpc.cancel()

    async def sleep(self, seconds: float) -> None:
        """Waits."""
        await asyncio.sleep(seconds)

    async def offload(self, function: Callable[..., T], *arguments: Any) -> T:
        """Runs what computes or reads files, in another thread."""
        return await asyncio.to_thread(function, *arguments)

    async def close(self) -> None:
        """Ends the calls that run, and the connection."""
        self._closed = True
        if self._channel is not None:
            await self._channel.close()
