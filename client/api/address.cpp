// SPDX-License-Identifier: Apache-2.0
#include "client/api/address.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "client/api/client.h"

namespace shapedb::client {

namespace {

/// What gRPC resolves by itself.
constexpr std::array<const char*, 6> kSchemes = {
    "unix:", "unix-abstract:", "dns:", "ipv4:", "ipv6:", "vsock:"};

bool beginsWith(const std::string& text, const std::string& beginning) {
    return text.compare(0, beginning.size(), beginning) == 0;
}

tl::unexpected<Error> refused(const std::string& address, const std::string& why) {
    return fail(ErrorCode::kInvalidArgument,
                "'" + address + "' is no address of a server: " + why +
                    "; give HOST:PORT, for example 127.0.0.1:" + std::to_string(kDefaultPort));
}

/// A number from 1 to 65535 in plain digits.
bool isPort(const std::string& text) {
    if (text.empty() || text.size() > 5) return false;
    if (!std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; }))
        return false;
    const int port = std::stoi(text);
    return port >= 1 && port <= 65535;
}

Result<std::string> withPort(const std::string& address, const std::string& host, const std::string& port) {
    if (host.empty() || host == "[]") return refused(address, "it has no host");
    if (port.empty()) return refused(address, "it has no port after the colon");
    if (!isPort(port)) return refused(address, "'" + port + "' is no port, which are 1 to 65535");
    return host + ":" + port;
}

}  // namespace

Result<std::string> checkedAddress(const std::string& address) {
    if (address.empty())
        return fail(ErrorCode::kInvalidArgument, "the server's address is empty; give HOST:PORT");
    const bool odd =
        std::any_of(address.begin(), address.end(), [](unsigned char c) { return c <= ' ' || c == 0x7f; });
    if (beginsWith(address, "http://") || beginsWith(address, "https://")) {
        return refused(address, std::string("it begins like that of a web page, whose port is another") +
                                    (beginsWith(address, "https") ? " (TLS is switched on apart)" : ""));
    }
    for (const std::string scheme : kSchemes) {
        if (!beginsWith(address, scheme)) continue;
        if (address.size() == scheme.size()) return refused(address, "nothing follows " + scheme);
        return address;
    }
    if (odd) return refused(address, "it has a blank or control character");
    if (const auto scheme = address.find("://"); scheme != std::string::npos) {
        return refused(address, "nobody knows how to reach " + address.substr(0, scheme + 3));
    }
    if (address.find_first_of("/@?#") != std::string::npos) {
        return refused(address, "it has more than a host and a port");
    }
    const std::string port = std::to_string(kDefaultPort);
    if (address.front() == '[') {
        const auto end = address.find(']');
        if (end == std::string::npos) return refused(address, "a ] is missing");
        const std::string host = address.substr(0, end + 1);
        if (end + 1 == address.size()) return withPort(address, host, port);
        if (address[end + 1] != ':') return refused(address, "after ] comes a colon and the port");
        return withPort(address, host, address.substr(end + 2));
    }
    const auto colon = address.find(':');
    if (colon == std::string::npos) return withPort(address, address, port);
    if (address.find(':', colon + 1) == std::string::npos) {
        return withPort(address, address.substr(0, colon), address.substr(colon + 1));
    }
    if (address.find_first_not_of("0123456789abcdefABCDEF:.") < address.find('%')) {
        return refused(address, "it has more than one colon");
    }
    return "[" + address + "]:" + port;  // a bare IPv6 address
}

}  // namespace shapedb::client
