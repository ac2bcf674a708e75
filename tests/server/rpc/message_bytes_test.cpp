// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/message_bytes.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "shapedb/v1/admin_service.pb.h"
#include "shapedb/v1/align_service.pb.h"
#include "shapedb/v1/shape_service.pb.h"

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

namespace {

template <typename Message>
bool plain(const std::string& bytes) {
    const grpc::Slice slice(bytes);
    return isPlain(grpc::ByteBuffer(&slice, 1), *Message::descriptor());
}

template <typename Message>
bool plain(const Message& message) {
    return plain<Message>(message.SerializeAsString());
}

TEST(PlainMessage, ABlockOfPointsOrOfABackupIs) {
    v1::AlignRequest points;
    points.mutable_chunk()->set_xyz(std::string(1 << 20, '\x7a'));
    EXPECT_TRUE(plain(points));
    v1::ImportCollectionRequest part;
    part.mutable_chunk()->set_total_bytes(1 << 30);
    part.mutable_chunk()->set_data(std::string(1 << 20, '\x7a'));
    part.mutable_chunk()->set_sha256(std::string(32, '\0'));
    EXPECT_TRUE(plain(part));
    EXPECT_TRUE(plain(v1::AlignRequest()));
}

TEST(PlainMessage, OneInManySlicesIsToo) {
    v1::AlignRequest points;
    points.mutable_chunk()->set_xyz(std::string(1000, 'a'));
    const std::string bytes = points.SerializeAsString();
    std::vector<grpc::Slice> slices;
    for (const char byte : bytes) slices.emplace_back(std::string(1, byte));
    EXPECT_TRUE(isPlain(grpc::ByteBuffer(slices.data(), slices.size()), *v1::AlignRequest::descriptor()));
}

TEST(PlainMessage, OneWithManyFieldsIsNot) {
    v1::AddShapeRequest request;
    request.mutable_header()->set_key("k");
    for (int i = 0; i < 3; ++i) (*request.mutable_header()->mutable_metadata())[std::to_string(i)] = "v";
    EXPECT_TRUE(plain(request));  // header, key, three entries, a key and a value in each
    for (int i = 3; i < 8; ++i) (*request.mutable_header()->mutable_metadata())[std::to_string(i)] = "v";
    EXPECT_FALSE(plain(request));
}

TEST(PlainMessage, OneWithFieldsThatNobodyKnowsIsNot) {
    v1::AlignRequest points;
    points.mutable_chunk()->set_xyz("abc");
    const std::string bytes = points.SerializeAsString();
    ASSERT_EQ(bytes.substr(2), std::string("\x0a\x03"
                                           "abc"));
    EXPECT_TRUE(plain<v1::AlignRequest>(bytes));
    for (const std::string unknown : {"\x7a\x01x", "\x7b\x7c", "\x78\x01"}) {
        EXPECT_FALSE(plain<v1::AlignRequest>(bytes + unknown)) << "beside it";
        std::string inside = bytes + unknown;
        inside[1] = static_cast<char>(inside[1] + static_cast<char>(unknown.size()));
        EXPECT_FALSE(plain<v1::AlignRequest>(inside)) << "in it";
    }
}

TEST(PlainMessage, OneThatIsCutOffIsNot) {
    v1::AlignRequest points;
    points.mutable_chunk()->set_xyz("abcdef");
    const std::string bytes = points.SerializeAsString();
    for (std::size_t size = 1; size < bytes.size(); ++size)
        EXPECT_FALSE(plain<v1::AlignRequest>(bytes.substr(0, size))) << size;
}

}  // namespace

}  // namespace shapedb::rpc
