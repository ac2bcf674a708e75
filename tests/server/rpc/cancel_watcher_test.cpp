// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/cancel_watcher.h"

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <string>

#include <grpcpp/client_context.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include "server/catalog/limits.h"
#include "shapedb/v1/search_service.grpc.pb.h"

namespace shapedb::rpc {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kStall{300};

/// Answers a call whose outcome is known, and is told that it writes so many bytes.
class AnswersAtOnce : public v1::SearchService::Service {
  public:
    AnswersAtOnce(CancelWatcher& watcher, std::size_t bytes) : watcher_(watcher), bytes_(bytes) {}

    grpc::Status SearchByScanInStages(
        grpc::ServerContext* context,
        grpc::ServerReaderWriter<v1::SearchByScanEvent, v1::SearchByScanRequest>* stream) override {
        CancelWatcher::Registration call(watcher_, *context);
        static_cast<void>(call.end());
        v1::SearchByScanEvent event;
        event.mutable_response()->set_candidates(1);
        const auto began = CancelWatcher::Clock::now();
        call.beginAnswer(bytes_);
        EXPECT_FALSE(stream->Write(event));
        took.set_value(std::chrono::duration_cast<milliseconds>(CancelWatcher::Clock::now() - began));
        return grpc::Status();
    }

    std::promise<milliseconds> took;

  private:
    CancelWatcher& watcher_;
    const std::size_t bytes_;
};

/// For how many milliseconds a client that reads nothing keeps an answer of so many bytes.
std::int64_t unreadFor(std::size_t bytes) {
    CancelWatcher watcher(kStall, 0);
    AnswersAtOnce service(watcher, bytes);
    grpc::ServerBuilder builder;
    builder.RegisterService(&service);
    const auto server = builder.BuildAndStart();
    const auto stub = v1::SearchService::NewStub(server->InProcessChannel({}));
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    const auto stream = stub->SearchByScanInStages(&context);
    const milliseconds took = service.took.get_future().get();
    v1::SearchByScanEvent event;
    while (stream->Read(&event)) continue;
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_NE(status.error_message().find("cut off by the server"), std::string::npos)
        << status.error_message();
    return took.count();
}

TEST(CancelWatcher, CutsOffWhoDoesNotReadTheAnswer) {
    const std::int64_t small = unreadFor(1000);
    EXPECT_GE(small, kStall.count());
    EXPECT_LT(small, 30'000) << "the client's deadline is later";
}

TEST(CancelWatcher, GivesLargeAnswersMoreTime) {
    EXPECT_GE(unreadFor(3 * catalog::kMaxChunkBytes), 4 * kStall.count());
}

}  // namespace
}  // namespace shapedb::rpc
