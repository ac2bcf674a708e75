// SPDX-License-Identifier: Apache-2.0
// What protobuf would send although it may not, with a word of its own on standard error: text that is no
// UTF-8. Private to client/api.
#pragma once

#include <google/protobuf/message.h>

#include "core/base/error.h"

namespace shapedb::client {

/// Errors: kInvalidArgument naming the field of the request, at any depth, that is not UTF-8.
[[nodiscard]] Result<void> requireUtf8(const google::protobuf::Message& request);

}  // namespace shapedb::client
