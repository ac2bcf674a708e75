// SPDX-License-Identifier: GPL-3.0-or-later
// The messages of a call. gRPC would decode the one message of a unary call, or of one that is answered by a
// stream, before the handler runs, whoever sent it, and a few megabytes can become a hundred in memory. So
// the handler reads it, once it is known that the caller may make the call, and if there is room. The same
// holds for each message of an upload.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/method_handler.h>
#include <grpcpp/support/sync_stream.h>

#include "core/base/return_if_error.h"
#include "server/catalog/gates.h"
#include "server/rpc/call.h"
#include "server/rpc/message_bytes.h"

namespace shapedb::rpc {

/// The most bytes of memory that one byte of a message can become: many empty texts of two bytes each.
constexpr std::uint64_t kMostDecodedPerByte = 32;
/// Messages up to this size need no room: that many calls are not made at a time.
constexpr std::uint64_t kSmallMessageBytes = std::uint64_t{16} << 10;

/// Errors: kInvalidArgument.
template <typename Message>
Result<void> decode(grpc::ByteBuffer& bytes, Message& message) {
    if (grpc::SerializationTraits<Message>::Deserialize(&bytes, &message).ok()) return {};
    return fail(ErrorCode::kInvalidArgument, "the message is not a " + Message::descriptor()->full_name());
}

/// What was received of a call, and the call itself: they live until its answer was written.
class Received {
  public:
    [[nodiscard]] Call& beginCall(const Services& services, grpc::ServerContext& context,
                                  const security::Operation& operation) {
        call_ = std::make_unique<Call>(services, context, operation);
        return *call_;
    }
    /// For the answer, held until this is destroyed. Once for a call.
    [[nodiscard]] catalog::AnswerRoom& answerRoom(catalog::Budget& answers) {
        answer_ = std::make_unique<catalog::AnswerRoom>(answers);
        return *answer_;
    }

    /// Writes the one message of the answer.
    template <typename Stream, typename Response>
    void write(Stream& stream, const Response& response) {
        if (call_) call_->beginAnswer(response);
        // A client that has gone needs no answer.
        if (!stream.Write(response) && call_) call_->noteUnreadAnswer();
    }

  private:
    std::unique_ptr<Call> call_;
    std::unique_ptr<catalog::AnswerRoom> answer_;
};

/// Used by the thread of its call. `stream`, given at construction, must outlive it.
template <typename Message>
class Request : public Received {
  public:
    template <typename Stream>
    explicit Request(Stream& stream)
        : read_([&stream](Call& call, grpc::ByteBuffer* bytes) { return call.read(stream, bytes); }) {}

    /// Reads and decodes it, holding room for the most that may become of it meanwhile, and for what became
    /// of it until it is destroyed. Errors: kCancelled (the client has gone), kQueueFull (no room),
    /// kInvalidArgument (not such a message).
    [[nodiscard]] Result<void> receive(Call& call, catalog::Budget& room) {
        grpc::ByteBuffer bytes;
        if (!read_(call, &bytes)) return fail(ErrorCode::kCancelled, "the client has gone");
        if (bytes.Length() <= kSmallMessageBytes) return decode(bytes, message_);
        {
            catalog::Budget::Share decoding(room);
            RETURN_IF_ERROR(decoding.take(kMostDecodedPerByte * bytes.Length()));
            RETURN_IF_ERROR(decode(bytes, message_));
        }
        share_ = std::make_unique<catalog::Budget::Share>(room);
        return share_->take(message_.SpaceUsedLong());
    }

    /// After `receive`.
    const Message& operator*() const { return message_; }
    const Message* operator->() const { return &message_; }

  private:
    std::function<bool(Call&, grpc::ByteBuffer*)> read_;
    std::unique_ptr<catalog::Budget::Share> share_;
    Message message_;
};

/// The messages of an upload, one after the other. Used by the thread of its call. `stream`, given at
/// construction, must outlive it.
template <typename Message>
class Upload : public Received {
  public:
    template <typename Stream>
    explicit Upload(Stream& stream)
        : read_([&stream](Call& call, grpc::ByteBuffer* bytes) { return call.read(stream, bytes); }) {}

    /// The next one, without fields that the API does not have; it holds room until the one after it is asked
    /// for, unless it is small or plain. Null at the end, and when the client has gone. Errors: kQueueFull
    /// (no room), kInvalidArgument (not such a message).
    [[nodiscard]] Result<const Message*> next(Call& call, catalog::Budget& room) {
        message_ = Message();
        share_.reset();
        grpc::ByteBuffer bytes;
        if (!read_(call, &bytes)) return nullptr;
        if (bytes.Length() > kSmallMessageBytes && !isPlain(bytes, *Message::descriptor())) {
            share_ = std::make_unique<catalog::Budget::Share>(room);
            RETURN_IF_ERROR(share_->take(kMostDecodedPerByte * bytes.Length()));
        }
        RETURN_IF_ERROR(decode(bytes, message_));
        // Whoever keeps a copy of a header keeps what was checked, and no more.
        message_.DiscardUnknownFields();
        return &message_;
    }

  private:
    std::function<bool(Call&, grpc::ByteBuffer*)> read_;
    std::unique_ptr<catalog::Budget::Share> share_;
    Message message_;
};

/// What a handler writes its stream of answers to.
template <typename Response>
using Replies = grpc::ServerSplitStreamer<grpc::ByteBuffer, Response>;
/// The same, of an upload.
template <typename Response>
using UploadReplies = grpc::ServerReaderWriter<Response, grpc::ByteBuffer>;

/// Runs `body(call)`, which returns Result<void>, as the handler of a call with one message, which is
/// received before.
template <typename Message, typename Body>
grpc::Status handle(const Services& services, grpc::ServerContext* context,
                    const security::Operation& operation, Request<Message>& request, Body&& body) {
    return runCall(request.beginCall(services, *context, operation), [&](Call& call) -> Result<void> {
        RETURN_IF_ERROR(request.receive(call, services.admission.requests));
        return body(call);
    });
}

/// The same of an upload, whose messages `body` receives.
template <typename Message, typename Body>
grpc::Status handle(const Services& services, grpc::ServerContext* context,
                    const security::Operation& operation, Upload<Message>& messages, Body&& body) {
    return runCall(messages.beginCall(services, *context, operation), body);
}

/// Runs `answer(&response)` and writes the one message of the answer to what was received.
template <typename Response, typename Stream, typename Answer>
grpc::Status writeAnswer(Received& received, Stream& stream, Answer&& answer) {
    Response response;
    const grpc::Status status = answer(&response);
    if (status.ok()) received.write(stream, response);
    return status;
}

/// For grpc::Service::MarkMethodStreamed: runs `method` of `handler`, which answers with one message.
template <typename Handler, typename Message, typename Response>
grpc::internal::MethodHandler* methodHandler(Handler* handler,
                                             grpc::Status (Handler::*method)(grpc::ServerContext*,
                                                                             Request<Message>&, Response*)) {
    using Stream = grpc::ServerUnaryStreamer<grpc::ByteBuffer, Response>;
    return new grpc::internal::StreamedUnaryHandler<grpc::ByteBuffer, Response>(
        [handler, method](grpc::ServerContext* context, Stream* stream) {
            Request<Message> request(*stream);
            return writeAnswer<Response>(request, *stream, [&](Response* response) {
                return (handler->*method)(context, request, response);
            });
        });
}

/// For the same: with a stream of messages.
template <typename Handler, typename Message, typename Response>
grpc::internal::MethodHandler* methodHandler(Handler* handler,
                                             grpc::Status (Handler::*method)(grpc::ServerContext*,
                                                                             Request<Message>&,
                                                                             Replies<Response>*)) {
    return new grpc::internal::SplitServerStreamingHandler<grpc::ByteBuffer, Response>(
        [handler, method](grpc::ServerContext* context, Replies<Response>* stream) {
            Request<Message> request(*stream);
            return (handler->*method)(context, request, stream);
        });
}

/// For the same: an upload that is answered with one message. Written here: gRPC's handler for such calls
/// would write it when the room that it holds has been given back.
template <typename Handler, typename Message, typename Response>
grpc::internal::MethodHandler* methodHandler(Handler* handler,
                                             grpc::Status (Handler::*method)(grpc::ServerContext*,
                                                                             Upload<Message>&, Response*)) {
    return new grpc::internal::BidiStreamingHandler<Handler, grpc::ByteBuffer, Response>(
        [method](Handler* self, grpc::ServerContext* context, UploadReplies<Response>* stream) {
            Upload<Message> upload(*stream);
            return writeAnswer<Response>(upload, *stream, [&](Response* response) {
                return (self->*method)(context, upload, response);
            });
        },
        handler);
}

/// For the same: an upload that is answered with a stream of messages.
template <typename Handler, typename Message, typename Response>
grpc::internal::MethodHandler* methodHandler(Handler* handler,
                                             grpc::Status (Handler::*method)(grpc::ServerContext*,
                                                                             Upload<Message>&,
                                                                             UploadReplies<Response>*)) {
    return new grpc::internal::BidiStreamingHandler<Handler, grpc::ByteBuffer, Response>(
        [method](Handler* self, grpc::ServerContext* context, UploadReplies<Response>* stream) {
            Upload<Message> upload(*stream);
            return (self->*method)(context, upload, stream);
        },
        handler);
}

/// `Service` of the API, generated, whose methods read their messages themselves.
template <typename Service>
class ReadsRequests : public Service::Service {
  protected:
    /// In the constructor, for each of them: `rpc` is its name in the API, `method` one of `handler`, this.
    /// `Messages`: Request or Upload.
    template <typename Handler, template <typename> class Messages, typename Message, typename Reply>
    void serve(const char* rpc, Handler* handler,
               grpc::Status (Handler::*method)(grpc::ServerContext*, Messages<Message>&, Reply*)) {
        const auto* service =
            Message::descriptor()->file()->pool()->FindServiceByName(Service::service_full_name());
        this->MarkMethodStreamed(service->FindMethodByName(rpc)->index(), methodHandler(handler, method));
    }
};

}  // namespace shapedb::rpc
