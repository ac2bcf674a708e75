// Server addresses as people write them.
#pragma once

#include <string>

namespace shapedb::client {

/// Adds the default port if there is none: "localhost" -> "localhost:7878", "::1" -> "[::1]:7878". Addresses
/// with a scheme of their own ("unix:/path", "dns:///host:1") stay as they are.
[[nodiscard]] std::string withDefaultPort(const std::string& address);

}  // namespace shapedb::client
