// Addresses of servers, as people write them.
#pragma once

#include <string>

namespace shapedb::client {

/// With the default port where none is given: "localhost" -> "localhost:7878", "::1" ->
/// "[::1]:7878". What names its own scheme ("unix:/path", "dns:///host:1") stays as it is.
[[nodiscard]] std::string withDefaultPort(const std::string& address);

}  // namespace shapedb::client
