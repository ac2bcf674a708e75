// SPDX-License-Identifier: GPL-3.0-or-later
// Messages as bytes, where protobuf alone would cost too much: the answer of SearchBatch, and what decoding
// takes.
#pragma once

#include <cstddef>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>

#include "shapedb/v1/search_service.pb.h"

namespace shapedb::rpc {

/// A shapedb.v1.SearchBatchResponse in the making, encoded query by query. gRPC would encode the whole of it,
/// megabytes, on the thread of the call at the end, and single searches beside it would wait for the
/// processor meanwhile.
class BatchAnswer {
  public:
    /// For this many queries, at least 1, all unanswered.
    explicit BatchAnswer(std::size_t queries) : encoded_(queries) {}

    /// Encodes the answer of query `i`. Threads may set different queries at the same time. At most 2 GiB - 1
    /// bytes.
    void set(std::size_t i, const shapedb::v1::SearchResponse& response);

    /// The message, once every query is answered. Copies no answer.
    [[nodiscard]] grpc::ByteBuffer message() const {
        return grpc::ByteBuffer(encoded_.data(), encoded_.size());
    }

  private:
    std::vector<grpc::Slice> encoded_;
};

// What decoding a message takes. Most large messages are one block of points or of a backup, and take little
// more than their bytes. Others may be made of many small fields, each of which takes some memory.

/// Whether the message consists of at most 16 fields, counting those of messages in it, all of which `type`
/// has and none of which is a packed list: then decoding it takes no more than its bytes and a few KiB.
[[nodiscard]] bool isPlain(const grpc::ByteBuffer& message, const google::protobuf::Descriptor& type);

}  // namespace shapedb::rpc
