#include "client/api/address.h"

#include <algorithm>

#include "client/api/client.h"

namespace shapedb::client {

std::string withDefaultPort(const std::string& address) {
    const std::string port = ":" + std::to_string(kDefaultPort);
    if (address.find('/') != std::string::npos || address.rfind("unix:", 0) == 0 ||
        address.rfind("unix-abstract:", 0) == 0) {
        return address;
    }
    if (!address.empty() && address.front() == '[') {
        return address.back() == ']' ? address + port : address;
    }
    switch (std::count(address.begin(), address.end(), ':')) {
        case 0: return address + port;
        case 1: return address;
        default: return "[" + address + "]" + port;  // a bare IPv6 address
    }
}

}  // namespace shapedb::client
