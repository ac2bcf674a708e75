// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/batch_answer.h"

#include <gtest/gtest.h>

namespace shapedb::rpc {
namespace {

namespace v1 = shapedb::v1;

std::string bytesOf(const grpc::ByteBuffer& buffer) {
    std::vector<grpc::Slice> slices;
    EXPECT_TRUE(buffer.Dump(&slices).ok());
    std::string bytes;
    for (const grpc::Slice& slice : slices) bytes.append(slice.begin(), slice.end());
    return bytes;
}

v1::SearchResponse answerWith(int hits) {
    v1::SearchResponse answer;
    for (int i = 0; i < hits; ++i) {
        answer.add_hits()->mutable_shape()->set_key("shape " + std::to_string(i));
        answer.mutable_hits(i)->set_score(1.0 / (i + 1));
    }
    return answer;
}

TEST(BatchAnswer, IsTheMessageThatProtobufWouldEncode) {
    v1::SearchBatchResponse whole;
    // Nothing at all, and sizes on both sides of one and of two bytes of length.
    const std::vector<int> hits = {0, 1, 3, 4, 5, 6, 100, 520, 1000};
    BatchAnswer batch(hits.size());
    for (std::size_t i = hits.size(); i-- > 0;) batch.set(i, answerWith(hits[i]));
    for (const int count : hits) *whole.add_responses() = answerWith(count);
    EXPECT_EQ(bytesOf(batch.message()), whole.SerializeAsString());
}

}  // namespace
}  // namespace shapedb::rpc
