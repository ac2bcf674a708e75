// SPDX-License-Identifier: GPL-3.0-or-later
// What decoding a message takes. Most large messages are one block of points or of a backup, and take little
// more than their bytes. Others may be made of many small fields, each of which takes some memory.
#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/support/byte_buffer.h>

namespace shapedb::rpc {

/// Whether the message consists of at most 16 fields, counting those of messages in it, all of which `type`
/// has and none of which is a packed list: then decoding it takes no more than its bytes and a few KiB.
[[nodiscard]] bool isPlain(const grpc::ByteBuffer& message, const google::protobuf::Descriptor& type);

}  // namespace shapedb::rpc
