# SPDX-License-Identifier: Apache-2.0
"""Errors: one class, told apart by the stable names of docs/api.md."""

from __future__ import annotations

from typing import Any, Iterable, Optional, Tuple

import grpc

REASONS: Tuple[str, ...] = (
    "non_finite_coordinate", "coordinate_out_of_range", "too_few_points", "all_points_equal", "collinear",
    "coplanar", "no_interior", "point_limit_exceeded", "file_not_readable", "unknown_file_format",
    "malformed_file", "file_not_writable", "invalid_argument", "malformed_filter", "malformed_cursor",
    "malformed_signature", "malformed_stream", "checksum_mismatch", "count_mismatch", "not_found",
    "already_exists", "version_conflict", "not_ready", "rejected", "unauthenticated", "permission_denied",
    "queue_full", "rate_limited", "unavailable", "cancelled", "deadline_exceeded", "out_of_memory", "storage",
    "storage_full", "data_loss", "schema_too_new", "internal",
)
"""All names that `ShapeDBError.reason` can have; a newer server may send others."""

# What a gRPC code means where no server of ours has named the error: a proxy answered, or nobody.
_REASON_OF_CODE = {
    grpc.StatusCode.INVALID_ARGUMENT: "invalid_argument",
    grpc.StatusCode.OUT_OF_RANGE: "point_limit_exceeded",
    grpc.StatusCode.NOT_FOUND: "not_found",
    grpc.StatusCode.ALREADY_EXISTS: "already_exists",
    grpc.StatusCode.ABORTED: "version_conflict",
    grpc.StatusCode.FAILED_PRECONDITION: "rejected",
    grpc.StatusCode.UNIMPLEMENTED: "unavailable",
    grpc.StatusCode.PERMISSION_DENIED: "permission_denied",
    grpc.StatusCode.UNAUTHENTICATED: "unauthenticated",
    grpc.StatusCode.UNAVAILABLE: "unavailable",
    grpc.StatusCode.CANCELLED: "cancelled",
    grpc.StatusCode.DEADLINE_EXCEEDED: "deadline_exceeded",
    grpc.StatusCode.DATA_LOSS: "data_loss",
}


# So begins the message if the server ended a call while it was sent or read: the code stands for the error then.
_CUT_OFF = "cut off by the server: "


class ShapeDBError(Exception):
    """A call that failed.

    `reason` is a stable name ("not_found", "queue_full", ...; all are in `shapedb.REASONS`): what programs
    should look at. `message` is for people: what was wrong, where, and what to do.
    """

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(reason, message)
        self.reason = reason
        self.message = message

    def __str__(self) -> str:
        return f"{self.message} [{self.reason}]"


class InvalidInput(ShapeDBError, ValueError):
    """The arguments cannot be used; nothing was sent."""


class Failure:
    """A failed attempt at a call: its error, and whether the server says when to come back."""

    def __init__(self, rpc_error: Any, address: str, tls: bool = False) -> None:
        code = rpc_error.code()
        trailing = _texts(rpc_error.trailing_metadata() or ())
        self.pushback: Optional[str] = trailing.get("grpc-retry-pushback-ms")
        self.error = _error_of(code, rpc_error.details() or "", trailing.get("shapedb-error"), address, tls)
        self.retry_reason = self.error.reason
        if code == grpc.StatusCode.RESOURCE_EXHAUSTED and self.pushback is not None:
            self.retry_reason = "queue_full"  # rate_limited and the like: there will be room
        if code == grpc.StatusCode.UNIMPLEMENTED:
            self.retry_reason = "rejected"  # it would not know the call next time either


def _texts(metadata: Iterable[Any]) -> dict[str, str]:
    return {key: value for key, value in metadata if isinstance(value, str)}


_PORT = "is it the right port? (that of the web page is another)"
_NO_WAY = "cannot reach a server at {}: there is no route to it from this machine"
_NO_HOST = "cannot reach a server at {}: its host name cannot be resolved"

# What gRPC and OpenSSL say when there is no connection, and what a user needs to hear; as in client/api/retry.cpp.
_TRANSLATIONS: Tuple[Tuple[str, str], ...] = (
    ("DNS resolution failed", _NO_HOST),
    ("C-ares", _NO_HOST),
    ("wrong version number", "what answers at {} does not speak TLS: connect without it (no tls, tls_ca or SHAPEDB_TLS), "
     "or switch it on at the server; or it is the port of the web page"),
    ("certificate verify failed", "the certificate of the server at {} cannot be trusted: it has expired, or another "
     "authority signed it than those that are trusted here; give the file of the right one as tls_ca, or renew the "
     "certificate"),
    ("is not in peer certificate", "the certificate of the server at {} is for another name: connect by a name that it "
     "has, or give that name as server_name"),
    ("empty address list", "the files for TLS cannot be used for {}: one is not PEM, or the certificate and the key do "
     "not belong together (tls_ca, client_certificate, client_key)"),
    ("Failed parsing HTTP/2", "what answers at {} is not a ShapeDB server: " + _PORT),
    ("http1.x", "what answers at {} is not a ShapeDB server: " + _PORT),
    ("Connection refused", "cannot reach a server at {}: nothing is listening there; is shapedbd running?"),
    ("No such file or directory", "cannot reach a server at {}: there is no such socket; is shapedbd running, and does "
     "it listen there?"),
    ("Permission denied", "cannot reach a server at {}: you may not use that socket"),
    ("No route to host", _NO_WAY),
    ("Network is unreachable", _NO_WAY),
    ("timed out", "cannot reach a server at {}: nothing answers there; is a firewall between?"),
)
# What becomes of a call when the server closes the connection at once.
_CLOSED = ("Socket closed", "Connection reset by peer", "Endpoint read failed", "Broken pipe")


def _unreachable(address: str, tls: bool, details: str) -> str:
    """Why there is no connection, in words of a user rather than of gRPC."""
    for words, plain in _TRANSLATIONS:
        if words in details:
            return plain.format(address)
    if any(words in details for words in _CLOSED):
        return f"the server at {address} closed the connection: " + (
            "it may ask for a certificate of yours (client_certificate, client_key), or is being stopped" if tls else
            "it probably wants TLS (tls=True, with tls_ca the file of its authority), or is being stopped")
    return f"cannot reach a server at {_named(address, tls)}: is shapedbd running there? ({details})"


def _named(address: str, tls: bool) -> str:
    return address + (" with TLS" if tls else "")


def _error_of(code: Any, details: str, name: Optional[str], address: str, tls: bool) -> ShapeDBError:
    if name is not None:
        return ShapeDBError(name, details)
    reason = _REASON_OF_CODE.get(code, "internal")
    if details.startswith(_CUT_OFF):
        return ShapeDBError(reason, details)
    if code == grpc.StatusCode.UNAVAILABLE:
        return ShapeDBError(reason, _unreachable(address, tls, details))
    if code == grpc.StatusCode.DEADLINE_EXCEEDED:
        return ShapeDBError(reason, f"the server at {_named(address, tls)} did not answer before the deadline")
    if code == grpc.StatusCode.UNIMPLEMENTED:
        told = f" ({details})" if details else ""
        return ShapeDBError(
            reason, f"what answers at {_named(address, tls)} does not know this call: it is not a ShapeDB server, or an older one{told}")
    return ShapeDBError(reason, details)
