// SPDX-License-Identifier: GPL-3.0-or-later
// W3C Trace Context: the header in which a client names the trace that a call belongs to.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace shapedb::rpc {

/// The trace id, 32 hexadecimal digits, of a `traceparent` (version-trace-parent-flags); nothing if it is not
/// valid. Version 00 ends there; later ones may go on after another dash, ff is none.
[[nodiscard]] std::optional<std::string> traceIdOf(std::string_view traceparent);

}  // namespace shapedb::rpc
