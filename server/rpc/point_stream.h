// Receives the points of one upload: AddShape, SearchByScan and Segment share it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/sha256.h"
#include "core/base/error.h"
#include "core/base/return_if_error.h"
#include "server/rpc/call.h"
#include "server/rpc/gates.h"

namespace shapedb::rpc {

struct ReceivedScan {
    std::vector<float> xyz;   ///< packed, every number finite
    Sha256Digest checksum{};  ///< of the bytes as they came
};

/// Takes header and chunks in the order they came. Resident memory grows with what arrived, never with
/// what was announced: of that only addresses are set aside, so that no growing copies the points. One per
/// upload; not thread-safe. After an error only destruction.
class PointReceiver {
  public:
    /// `maxPoints` as config limits.max_points; `budget` is not owned.
    PointReceiver(std::uint64_t maxPoints, Budget& budget) : maxPoints_(maxPoints), share_(budget) {}

    /// Errors: kMalformedStream (second header), kTooFewPoints (announced),
    /// kPointLimitExceeded (announced), kInvalidArgument (sha256 neither empty nor 32 bytes).
    [[nodiscard]] Result<void> begin(std::uint64_t announced, const std::string& sha256);

    /// Errors: kMalformedStream (no header yet, chunk empty, too long or not whole points, or
    /// after all points announced have come), kCountMismatch (more points than announced),
    /// kNonFiniteCoordinate (names the point's index from 0 and the axis), kQueueFull (memory
    /// of all uploads together).
    [[nodiscard]] Result<void> add(const std::string& xyz);

    /// The stream has ended. Errors: kMalformedStream (no header), kCountMismatch (fewer
    /// points than announced), kChecksumMismatch.
    [[nodiscard]] Result<ReceivedScan> finish();

    [[nodiscard]] std::uint64_t points() const { return scan_.xyz.size() / 3; }

  private:
    void setAside(std::uint64_t points);
    Result<void> checkChunk(const std::string& xyz) const;

    std::uint64_t maxPoints_;
    Budget::Share share_;
    std::optional<std::uint64_t> announced_;
    std::string wantedChecksum_;
    Sha256 hash_;
    ReceivedScan scan_;
};

/// Reads a whole upload. `onHeader(header)` checks the header's other fields as soon as they
/// are there, so that a hopeless upload is refused before its points are sent.
/// Errors: those of the receiver and of `onHeader`; kCancelled, kDeadlineExceeded.
template <typename Request, typename Reader, typename OnHeader>
Result<ReceivedScan> receiveScan(Reader& reader, PointReceiver& receiver, Call& call, OnHeader&& onHeader) {
    Request request;
    while (call.read(reader, &request)) {
        RETURN_IF_ERROR(call.run().checkpoint());
        Result<void> taken;
        if (request.has_header()) {
            taken = receiver.begin(request.header().point_count(), request.header().sha256());
            if (taken) taken = onHeader(request.header());
        } else if (request.has_chunk()) {
            taken = receiver.add(request.chunk().xyz());
            if (taken) call.addPoints(request.chunk().xyz().size() / 12, request.chunk().xyz().size());
        } else {
            taken = fail(ErrorCode::kMalformedStream, "message with neither header nor chunk");
        }
        RETURN_IF_ERROR(taken);
    }
    // `Read` also ends when the client has gone: then nothing was completed.
    if (call.clientGone()) return fail(ErrorCode::kCancelled, "the client cancelled the upload");
    return receiver.finish();
}

}  // namespace shapedb::rpc
