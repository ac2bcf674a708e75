// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/integration/support/client.h"

#include <cstring>

#include <gtest/gtest.h>

#include "common/sha256.h"

namespace shapedb::testing {
namespace {

std::string trailing(const grpc::ClientContext& context, const char* name) {
    const auto& metadata = context.GetServerTrailingMetadata();
    const auto found = metadata.find(name);
    return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const Outcome& outcome) {
    return out << "code " << outcome.status.error_code() << ", error '" << outcome.error << "', "
               << outcome.status.error_message();
}

Client::Client(const std::string& address) {
    grpc::ChannelArguments arguments;
    arguments.SetMaxReceiveMessageSize(-1);
    // Otherwise the channels of a process share connections, even to a server that was killed.
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    // A refused call must be seen, not silently repeated.
    arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
    channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
    shapes = pb::ShapeService::NewStub(channel);
    searches = pb::SearchService::NewStub(channel);
    aligns = pb::AlignService::NewStub(channel);
    collections = pb::CollectionService::NewStub(channel);
    admin = pb::AdminService::NewStub(channel);
    health = grpc::health::v1::Health::NewStub(channel);
}

CallContext::CallContext(std::chrono::milliseconds timeout) {
    context_.set_deadline(std::chrono::system_clock::now() + timeout);
}

Outcome CallContext::outcome(const grpc::Status& status) const {
    return {status, trailing(context_, "shapedb-error"), trailing(context_, "grpc-retry-pushback-ms")};
}

std::string bytesOf(const Scan& scan) {
    std::string bytes(scan.size() * sizeof(float), '\0');
    std::memcpy(bytes.data(), scan.data(), bytes.size());
    return bytes;
}

std::vector<std::string> chunksOf(const Scan& scan, std::size_t pointsPerChunk) {
    const std::string bytes = bytesOf(scan);
    std::vector<std::string> chunks;
    for (std::size_t at = 0; at < bytes.size(); at += 12 * pointsPerChunk) {
        chunks.push_back(bytes.substr(at, 12 * pointsPerChunk));
    }
    return chunks;
}

std::string sha256Of(const Scan& scan) {
    const auto digest = sha256(scan.data(), scan.size() * sizeof(float));
    return {reinterpret_cast<const char*>(digest.data()), digest.size()};
}

pb::AddShapeHeader headerFor(const std::string& collection, const std::string& key, const Scan& scan) {
    pb::AddShapeHeader header;
    header.set_collection(collection);
    header.set_key(key);
    header.set_point_count(scan.size() / 3);
    return header;
}

Reply<pb::AddShapeResponse> sendAddShape(Client& client, const std::vector<pb::AddShapeRequest>& messages,
                                         std::chrono::milliseconds timeout) {
    CallContext context(timeout);
    Reply<pb::AddShapeResponse> reply;
    const auto writer = client.shapes->AddShape(&context, &reply.value);
    for (const pb::AddShapeRequest& message : messages) {
        if (!writer->Write(message)) break;  // refused early: the status says why
    }
    writer->WritesDone();
    static_cast<Outcome&>(reply) = context.outcome(writer->Finish());
    return reply;
}

Reply<pb::AddShapeResponse> addShape(Client& client, const pb::AddShapeHeader& header, const Scan& scan,
                                     std::chrono::milliseconds timeout) {
    std::vector<pb::AddShapeRequest> messages(1);
    *messages.front().mutable_header() = header;
    for (const std::string& chunk : chunksOf(scan, 50'000)) {
        messages.emplace_back().mutable_chunk()->set_xyz(chunk);
    }
    return sendAddShape(client, messages, timeout);
}

Reply<pb::AddShapeResponse> addAndWait(Client& client, const std::string& collection, const std::string& key,
                                       const Scan& scan, const std::map<std::string, std::string>& metadata) {
    pb::AddShapeHeader header = headerFor(collection, key, scan);
    header.set_wait(true);
    for (const auto& [name, value] : metadata) (*header.mutable_metadata())[name] = value;
    return addShape(client, header, scan);
}

Reply<pb::SearchResponse> searchByScan(Client& client, const pb::SearchOptions& options, const Scan& scan,
                                       std::chrono::milliseconds timeout) {
    CallContext context(timeout);
    Reply<pb::SearchResponse> reply;
    const auto writer = client.searches->SearchByScan(&context, &reply.value);
    pb::SearchByScanRequest message;
    *message.mutable_header()->mutable_options() = options;
    message.mutable_header()->set_point_count(scan.size() / 3);
    bool open = writer->Write(message);
    for (const std::string& chunk : chunksOf(scan, 50'000)) {
        message.mutable_chunk()->set_xyz(chunk);
        open = open && writer->Write(message);
    }
    writer->WritesDone();
    static_cast<Outcome&>(reply) = context.outcome(writer->Finish());
    return reply;
}

namespace {

/// A header, the points, and all that is answered.
template <typename Request, typename Answer, typename Call, typename Header>
Stream<Answer> sendScan(CallContext& context, Call& stream, Header header, const Scan& scan) {
    header.set_point_count(scan.size() / 3);
    Request message;
    *message.mutable_header() = header;
    bool open = stream.Write(message);
    for (const std::string& chunk : chunksOf(scan, 50'000)) {
        message.mutable_chunk()->set_xyz(chunk);
        open = open && stream.Write(message);
    }
    stream.WritesDone();
    Stream<Answer> result;
    Answer part;
    while (stream.Read(&part)) result.messages.push_back(part);
    static_cast<Outcome&>(result) = context.outcome(stream.Finish());
    return result;
}

}  // namespace

Stream<pb::SearchByScanEvent> searchInStages(Client& client, const pb::SearchOptions& options,
                                             const Scan& scan, std::chrono::milliseconds timeout) {
    CallContext context(timeout);
    pb::SearchByScanHeader header;
    *header.mutable_options() = options;
    return sendScan<pb::SearchByScanRequest, pb::SearchByScanEvent>(
        context, *client.searches->SearchByScanInStages(&context), header, scan);
}

Stream<pb::SegmentedPoints> segmentScan(Client& client, const pb::SegmentHeader& header, const Scan& scan,
                                        std::chrono::milliseconds timeout) {
    CallContext context(timeout);
    return sendScan<pb::SegmentRequest, pb::SegmentedPoints>(context, *client.shapes->Segment(&context),
                                                             header, scan);
}
Reply<pb::Shape> getShape(Client& client, const std::string& collection, const std::string& key) {
    pb::GetShapeRequest request;
    request.mutable_shape()->set_collection(collection);
    request.mutable_shape()->set_key(key);
    const auto reply = unary(*client.shapes, &pb::ShapeService::Stub::GetShape, request);
    Reply<pb::Shape> shape;
    static_cast<Outcome&>(shape) = reply;
    shape.value = reply.value.shape();
    return shape;
}

Reply<pb::Collection> createCollection(Client& client, const std::string& name, pb::Profile profile) {
    pb::CreateCollectionRequest request;
    request.set_name(name);
    request.set_profile(profile);
    return unary(*client.collections, &pb::CollectionService::Stub::CreateCollection, request);
}

std::vector<pb::Shape> listAll(Client& client, const std::string& collection) {
    std::vector<pb::Shape> all;
    pb::ListShapesRequest request;
    request.set_collection(collection);
    do {
        const auto reply = unary(*client.shapes, &pb::ShapeService::Stub::ListShapes, request);
        EXPECT_TRUE(reply.ok()) << reply;
        all.insert(all.end(), reply.value.shapes().begin(), reply.value.shapes().end());
        request.set_cursor(reply.value.next_cursor());
    } while (!request.cursor().empty());
    return all;
}

pb::StatsResponse statsOf(Client& client) {
    const auto reply = unary(*client.admin, &pb::AdminService::Stub::Stats, pb::StatsRequest());
    EXPECT_TRUE(reply.ok()) << reply;
    return reply.value;
}

pb::SearchOptions searchOptions(const std::string& collection, std::uint32_t k) {
    pb::SearchOptions options;
    options.set_collection(collection);
    options.set_k(k);
    return options;
}

}  // namespace shapedb::testing
