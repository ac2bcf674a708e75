// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/request.h"

#include <chrono>
#include <memory>
#include <string>

#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include "shapedb/v1/search_service.grpc.pb.h"
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

/// Answers each search with the same megabytes.
class LargeAnswers : public ReadsRequests<v1::SearchService> {
  public:
    explicit LargeAnswers(catalog::Budget& answers) : answers_(answers) {
        serve("SearchByScan", this, &LargeAnswers::once);
        serve("SearchByScanInStages", this, &LargeAnswers::inStages);
    }

  private:
    grpc::Status once(grpc::ServerContext* /*context*/, Upload<v1::SearchByScanRequest>& upload,
                      v1::SearchResponse* response) {
        const auto taken = upload.answerRoom(answers_).take(60 * kMebibyte);
        response->add_hits()->mutable_shape()->set_key(std::string(kMebibyte, 'k'));
        return taken ? grpc::Status() : grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "no room");
    }
    grpc::Status inStages(grpc::ServerContext* context, Upload<v1::SearchByScanRequest>& upload,
                          UploadReplies<v1::SearchByScanEvent>* writer) {
        v1::SearchByScanEvent last;
        const grpc::Status status = once(context, upload, last.mutable_response());
        writer->Write(last);
        return status;
    }

    catalog::Budget& answers_;
};

class UnreadAnswer : public ::testing::Test {
  protected:
    UnreadAnswer() {
        grpc::ServerBuilder builder;
        builder.RegisterService(&service_);
        server_ = builder.BuildAndStart();
        stub_ = v1::SearchService::NewStub(server_->InProcessChannel({}));
        context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    }
    ~UnreadAnswer() override {
        server_->Shutdown();
        queue_.Shutdown();
    }

    /// Waits for one more operation of the client.
    void wait() {
        void* tag = nullptr;
        bool good = false;
        ASSERT_TRUE(queue_.Next(&tag, &good));
        ASSERT_TRUE(good);
    }
    /// The client sends its upload and then reads no more than that an answer comes.
    template <typename Stream>
    void upload(Stream& stream) {
        stream.WritesDone(this);
        wait();
        stream.ReadInitialMetadata(this);
        wait();
    }
    ErrorCode another() {
        const auto taken = catalog::AnswerRoom(answers_).take(50 * kMebibyte);
        return taken ? ErrorCode::kInternal : taken.error().code;
    }
    void expectRoomAgain() {
        server_->Shutdown();  // waits for the handlers
        EXPECT_TRUE(catalog::AnswerRoom(answers_).take(50 * kMebibyte));
    }

    catalog::Budget answers_{100 * kMebibyte, "bytes of answers"};
    LargeAnswers service_{answers_};
    std::unique_ptr<grpc::Server> server_;
    std::unique_ptr<v1::SearchService::Stub> stub_;
    grpc::ClientContext context_;
    grpc::CompletionQueue queue_;
};

TEST_F(UnreadAnswer, OfAnUploadKeepsItsRoom) {
    v1::SearchResponse response;
    const auto stream = stub_->AsyncSearchByScan(&context_, &response, &queue_, this);
    wait();
    upload(*stream);
    EXPECT_EQ(another(), ErrorCode::kQueueFull);
    grpc::Status status;
    stream->Finish(&status, this);
    wait();
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.hits_size(), 1);
    expectRoomAgain();
}

TEST_F(UnreadAnswer, OfAnUploadInStagesKeepsItsRoom) {
    const auto stream = stub_->AsyncSearchByScanInStages(&context_, &queue_, this);
    wait();
    upload(*stream);
    EXPECT_EQ(another(), ErrorCode::kQueueFull);
    v1::SearchByScanEvent event;
    stream->Read(&event, this);
    wait();
    EXPECT_EQ(event.response().hits_size(), 1);
    grpc::Status status;
    stream->Finish(&status, this);
    wait();
    EXPECT_TRUE(status.ok()) << status.error_message();
    expectRoomAgain();
}

}  // namespace
}  // namespace shapedb::rpc
