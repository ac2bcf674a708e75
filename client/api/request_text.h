// SPDX-License-Identifier: Apache-2.0
// Refuses text that is not UTF-8: protobuf would only complain on standard error and send it all the same.
// Private to client/api.
#pragma once

#include <google/protobuf/message.h>

#include "core/base/error.h"

namespace shapedb::client {

/// Errors: kInvalidArgument naming the field of the request, at any depth, that is not UTF-8.
[[nodiscard]] Result<void> requireUtf8(const google::protobuf::Message& request);

}  // namespace shapedb::client
