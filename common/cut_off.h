// SPDX-License-Identifier: Apache-2.0
// How the status of a call shows that the server cut it off while its client was sending or reading.
#pragma once

namespace shapedb {

/// Such a status has a code and a message of its own but no trailing metadata, in which other failures name
/// their error: the message begins with this instead, and the code stands for the error.
constexpr char kCutOffPrefix[] = "cut off by the server: ";

}  // namespace shapedb
