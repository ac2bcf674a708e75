# SPDX-License-Identifier: Apache-2.0
"""The address of a server, checked before anybody connects; client/api/credentials.cpp has the same rules."""

from __future__ import annotations

from ._errors import InvalidInput

DEFAULT_PORT = 7878
_SCHEMES = ("unix:", "unix-abstract:", "dns:", "ipv4:", "ipv6:", "vsock:")


def checked_address(address: str) -> str:
    """"localhost" -> "localhost:7878", "::1" -> "[::1]:7878"; what has a port, or a scheme of gRPC, stays. Raises
    `InvalidInput`, saying what to give instead."""
    if not address:
        raise InvalidInput("invalid_argument", "the server's address is empty; give HOST:PORT")
    if address.startswith(("http://", "https://")):
        apart = " (TLS is switched on apart)" if address.startswith("https") else ""
        raise _refused(address, f"that is a web address; the API has another port{apart}")
    for scheme in _SCHEMES:
        if address.startswith(scheme):
            if address == scheme:
                raise _refused(address, f"nothing follows {scheme}")
            return address
    if any(character <= " " or character == "\x7f" for character in address):
        raise _refused(address, "it has a blank or control character")
    before, found, _ = address.partition("://")
    if found:
        raise _refused(address, f"nobody knows how to reach {before}://")
    if any(character in "/@?#" for character in address):
        raise _refused(address, "it has more than a host and a port")
    if address.startswith("["):
        host, closed, rest = address.partition("]")
        if not closed:
            raise _refused(address, "a ] is missing")
        if rest and not rest.startswith(":"):
            raise _refused(address, "after ] comes a colon and the port")
        return _with_port(address, host + "]", rest[1:] if rest else str(DEFAULT_PORT))
    if address.count(":") > 1:
        if not set(address.partition("%")[0]) <= set("0123456789abcdefABCDEF:."):
            raise _refused(address, "it has more than one colon")
        return f"[{address}]:{DEFAULT_PORT}"  # a bare IPv6 address
    host, colon, port = address.partition(":")
    return _with_port(address, host, port if colon else str(DEFAULT_PORT))


def _with_port(address: str, host: str, port: str) -> str:
    if host in ("", "[]"):
        raise _refused(address, "it has no host")
    if not port:
        raise _refused(address, "it has no port after the colon")
    if not (port.isascii() and port.isdigit() and len(port) <= 5 and 1 <= int(port) <= 65535):
        raise _refused(address, f"'{port}' is not a port (1 to 65535)")
    return f"{host}:{port}"


def _refused(address: str, why: str) -> InvalidInput:
    return InvalidInput("invalid_argument", f"'{address}' is no address of a server: {why}; give HOST:PORT, for example "
                        f"127.0.0.1:{DEFAULT_PORT}")
