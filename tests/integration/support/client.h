// SPDX-License-Identifier: GPL-3.0-or-later
// A client on the generated stubs that returns everything a call gave back.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "health.grpc.pb.h"
#include "shapedb/v1/admin_service.grpc.pb.h"
#include "shapedb/v1/align_service.grpc.pb.h"
#include "shapedb/v1/collection_service.grpc.pb.h"
#include "shapedb/v1/search_service.grpc.pb.h"
#include "shapedb/v1/shape_service.grpc.pb.h"
#include "tests/integration/support/scans.h"
#include "tests/support/eventually.h"

namespace shapedb::testing {

namespace pb = shapedb::v1;

/// How a call ended.
struct Outcome {
    grpc::Status status;
    std::string error;       ///< trailing metadata shapedb-error
    std::string retryAfter;  ///< trailing metadata grpc-retry-pushback-ms

    [[nodiscard]] bool ok() const { return status.ok(); }
};

std::ostream& operator<<(std::ostream& out, const Outcome& outcome);

/// Outcome and answer.
template <typename Response>
struct Reply : Outcome {
    Response value;
};

/// All messages of a stream.
template <typename Response>
struct Stream : Outcome {
    std::vector<Response> messages;
};

struct Client {
    explicit Client(const std::string& address);

    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<pb::ShapeService::Stub> shapes;
    std::unique_ptr<pb::SearchService::Stub> searches;
    std::unique_ptr<pb::AlignService::Stub> aligns;
    std::unique_ptr<pb::CollectionService::Stub> collections;
    std::unique_ptr<pb::AdminService::Stub> admin;
    std::unique_ptr<grpc::health::v1::Health::Stub> health;
};

/// A context whose calls cannot hang a test.
class CallContext {
  public:
    explicit CallContext(std::chrono::milliseconds timeout = std::chrono::seconds(60));
    grpc::ClientContext* operator&() { return &context_; }
    grpc::ClientContext& get() { return context_; }
    [[nodiscard]] Outcome outcome(const grpc::Status& status) const;

  private:
    grpc::ClientContext context_;
};

/// `unary(*client.shapes, &pb::ShapeService::Stub::GetShape, request)`.
template <typename Stub, typename Base, typename Request, typename Response>
Reply<Response> unary(Stub& stub,
                      grpc::Status (Base::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request, std::chrono::milliseconds timeout = std::chrono::seconds(60)) {
    CallContext context(timeout);
    Reply<Response> reply;
    const grpc::Status status = (stub.*method)(&context, request, &reply.value);
    static_cast<Outcome&>(reply) = context.outcome(status);
    return reply;
}

/// Reads a server stream to its end.
template <typename Response>
Stream<Response> drain(CallContext& context, grpc::ClientReaderInterface<Response>& reader) {
    Stream<Response> stream;
    Response message;
    while (reader.Read(&message)) stream.messages.push_back(message);
    static_cast<Outcome&>(stream) = context.outcome(reader.Finish());
    return stream;
}

/// The bytes of a scan as they travel.
[[nodiscard]] std::string bytesOf(const Scan& scan);
/// In chunks of whole points.
[[nodiscard]] std::vector<std::string> chunksOf(const Scan& scan, std::size_t pointsPerChunk = 1'000);
[[nodiscard]] std::string sha256Of(const Scan& scan);

/// Header with collection, key and the right point count.
[[nodiscard]] pb::AddShapeHeader headerFor(const std::string& collection, const std::string& key,
                                           const Scan& scan);

/// Sends exactly these messages.
[[nodiscard]] Reply<pb::AddShapeResponse> sendAddShape(
    Client& client, const std::vector<pb::AddShapeRequest>& messages,
    std::chrono::milliseconds timeout = std::chrono::seconds(60));
/// Header and all points.
[[nodiscard]] Reply<pb::AddShapeResponse> addShape(
    Client& client, const pb::AddShapeHeader& header, const Scan& scan,
    std::chrono::milliseconds timeout = std::chrono::seconds(60));
/// Adds and waits until it is segmented.
[[nodiscard]] Reply<pb::AddShapeResponse> addAndWait(Client& client, const std::string& collection,
                                                     const std::string& key, const Scan& scan,
                                                     const std::map<std::string, std::string>& metadata = {});
[[nodiscard]] Reply<pb::SearchResponse> searchByScan(
    Client& client, const pb::SearchOptions& options, const Scan& scan,
    std::chrono::milliseconds timeout = std::chrono::seconds(60));
[[nodiscard]] Stream<pb::SearchByScanEvent> searchInStages(
    Client& client, const pb::SearchOptions& options, const Scan& scan,
    std::chrono::milliseconds timeout = std::chrono::seconds(60));
[[nodiscard]] Stream<pb::SegmentedPoints> segmentScan(
    Client& client, const pb::SegmentHeader& header, const Scan& scan,
    std::chrono::milliseconds timeout = std::chrono::seconds(60));

[[nodiscard]] Reply<pb::Shape> getShape(Client& client, const std::string& collection,
                                        const std::string& key);
[[nodiscard]] Reply<pb::Collection> createCollection(Client& client, const std::string& name,
                                                     pb::Profile profile = pb::PROFILE_PAPER);
/// All pages.
[[nodiscard]] std::vector<pb::Shape> listAll(Client& client, const std::string& collection);
[[nodiscard]] pb::StatsResponse statsOf(Client& client);
[[nodiscard]] pb::SearchOptions searchOptions(const std::string& collection, std::uint32_t k = 5);

}  // namespace shapedb::testing
