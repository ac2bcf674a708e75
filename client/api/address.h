// SPDX-License-Identifier: Apache-2.0
// The address of a server, checked before anybody connects: gRPC would take a slip for a host that cannot be
// found.
#pragma once

#include <string>

#include "core/base/error.h"

namespace shapedb::client {

/// "localhost" -> "localhost:7878", "::1" -> "[::1]:7878". Addresses with a port, and those that gRPC has a
/// scheme for ("unix:/path", "dns:///host:1"), stay as they are. client/python/src/shapedb/_address.py has
/// the same rules.
///
/// Errors: kInvalidArgument (a web address, no host, a port that is none, words of other schemes), saying
/// what to give instead.
[[nodiscard]] Result<std::string> checkedAddress(const std::string& address);

}  // namespace shapedb::client
