# SPDX-License-Identifier: Apache-2.0
"""How to reach a server: its address, TLS, the API key. The rules are those of the `shapedb` command."""

from __future__ import annotations

import ipaddress
import os
import stat
from dataclasses import dataclass, field
from typing import Any, List, Mapping, Optional, Tuple, Union

import grpc

from ._address import checked_address
from ._errors import InvalidInput, ShapeDBError

PathLike = Union[str, "os.PathLike[str]"]

_MOST_BYTES = 1 << 20


class _Secret(str):
    """Text that no debugger, log or traceback shows."""

    def __repr__(self) -> str:
        return "'***'"


@dataclass(frozen=True)
class Target:
    """A server, and how to talk to it. Shows no secrets."""

    address: str
    credentials: Optional[Any] = field(repr=False)
    """For a channel with TLS; None without."""
    options: Tuple[Tuple[str, Any], ...] = field(repr=False)
    metadata: Tuple[Tuple[str, str], ...] = field(repr=False)
    """Sent with every call: the API key."""

    @property
    def name(self) -> str:
        """For messages."""
        return self.address + (" with TLS" if self.credentials is not None else "")


def target_of(address: Optional[str], *, api_key: Optional[str], api_key_file: Optional[PathLike], tls: Optional[bool],
              tls_ca: Optional[PathLike], client_certificate: Optional[PathLike], client_key: Optional[PathLike],
              server_name: Optional[str], environment: Optional[Mapping[str, str]]) -> Target:
    """What the arguments say, and where they say nothing the environment (docs/python.md lists the variables).

    Raises `InvalidInput` if options contradict each other or an API key would travel unprotected, `ShapeDBError`
    with file_not_readable for keys and certificates.
    """
    variables = os.environ if environment is None else environment

    def given(value: Optional[PathLike], variable: str) -> str:
        return os.fspath(value) if value is not None else variables.get(variable, "")

    where = checked_address(given(address, "SHAPEDB_SERVER") or "127.0.0.1")
    ca = given(tls_ca, "SHAPEDB_TLS_CA")
    certificate = given(client_certificate, "SHAPEDB_CLIENT_CERTIFICATE")
    key = given(client_key, "SHAPEDB_CLIENT_KEY")
    enabled = tls if tls is not None else (variables.get("SHAPEDB_TLS", "") not in ("", "0") or ca != "")
    secret = _api_key(api_key, api_key_file, variables)
    if secret and not enabled and not is_this_machine(where):
        raise InvalidInput("invalid_argument", f"the API key would travel unprotected to {where}: use TLS")
    credentials, options = _credentials(enabled, ca, certificate, key, server_name)
    metadata = (("authorization", _Secret("Bearer " + secret)),) if secret else ()
    return Target(where, credentials, (*_CHANNEL_OPTIONS, *options), metadata)


# As in client/api/client.cpp: large replies; retries are ours; reconnecting keeps pace with them.
_CHANNEL_OPTIONS: Tuple[Tuple[str, Any], ...] = (
    ("grpc.max_receive_message_length", -1),
    ("grpc.enable_retries", 0),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 5000),
    ("grpc.max_reconnect_backoff_ms", 2000),
    ("grpc.use_local_subchannel_pool", 1),
)


def is_this_machine(address: str) -> bool:
    """Of an address with its port or scheme. Names are not resolved."""
    if address.startswith(("unix:", "unix-abstract:", "localhost:", "[::1]:")):
        return True
    try:
        # A name may begin like an address: 127.example.org.
        return ipaddress.IPv4Address(address.rpartition(":")[0]).is_loopback
    except ValueError:
        return False


def _api_key(key: Optional[str], file: Optional[PathLike], variables: Mapping[str, str]) -> _Secret:
    if key is None and file is None:
        key = variables.get("SHAPEDB_API_KEY") or None
        file = variables.get("SHAPEDB_API_KEY_FILE") or None
    if not key and file is not None:
        text = _read("API key file", os.fspath(file)).decode("utf-8", "replace")
        key = text.replace("\r", "\n").partition("\n")[0]
        if not key:
            raise InvalidInput("invalid_argument", f"API key file {os.fspath(file)} has no key in its first line")
    secret = _Secret(key or "")
    if any(not "!" <= character <= "~" for character in secret):
        raise InvalidInput("invalid_argument", "the API key has a character that no key has")
    return secret


def _read(what: str, path: str) -> bytes:
    try:
        # Without waiting: opening a pipe would block until somebody writes to it.
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise OSError("it is not a regular file")
            data = file.read(_MOST_BYTES + 1)
    except OSError as error:
        raise ShapeDBError("file_not_readable", f"{what} {path} cannot be read: {error.strerror or error}") from None
    if len(data) > _MOST_BYTES:
        raise ShapeDBError("malformed_file", f"{what} {path} has more than {_MOST_BYTES} bytes")
    return data


def _credentials(enabled: bool, ca: str, certificate: str, key: str,
                 server_name: Optional[str]) -> Tuple[Optional[Any], List[Tuple[str, Any]]]:
    if not enabled:
        if ca or certificate or key:
            raise InvalidInput("invalid_argument", "there are files for TLS, but TLS is not enabled")
        # A proxy that the environment names would read all that is said, the key too.
        return None, [("grpc.enable_http_proxy", 0)]
    if bool(certificate) != bool(key):
        raise InvalidInput("invalid_argument",
                           "the client's certificate and its key belong together: give both or neither")
    credentials = grpc.ssl_channel_credentials(
        root_certificates=_read("CA file", ca) if ca else None,
        private_key=_read("key file", key) if key else None,
        certificate_chain=_read("certificate file", certificate) if certificate else None)
    return credentials, [("grpc.ssl_target_name_override", server_name)] if server_name else []
