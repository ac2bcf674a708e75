// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/request.h"

#include <gtest/gtest.h>

#include "shapedb/v1/shape_service.pb.h"

namespace shapedb::rpc {
namespace {

struct NoStream {
    bool Read(grpc::ByteBuffer* /*bytes*/) { return false; }
};

constexpr std::size_t kMebibyte = std::size_t{1} << 20;

TEST(Request, KeepsTheRoomOfItsAnswerUntilItIsDestroyed) {
    catalog::Budget answers(100 * kMebibyte, "bytes of answers");
    NoStream stream;
    {
        Request<v1::GetShapesRequest> request(stream);
        {
            catalog::AnswerRoom& room = request.answerRoom(answers);
            ASSERT_TRUE(room.take(40 * kMebibyte));
            ASSERT_TRUE(room.take(20 * kMebibyte));
            const auto beyond = room.take(5 * kMebibyte);
            EXPECT_EQ(beyond.error().code, ErrorCode::kInvalidArgument) << "one answer has 64 MiB at most";
        }
        catalog::AnswerRoom other(answers);
        EXPECT_EQ(other.take(50 * kMebibyte).error().code, ErrorCode::kQueueFull);
        EXPECT_TRUE(other.take(40 * kMebibyte));
    }
    EXPECT_TRUE(catalog::AnswerRoom(answers).take(60 * kMebibyte));
}

}  // namespace
}  // namespace shapedb::rpc
