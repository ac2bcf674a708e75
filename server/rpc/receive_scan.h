// SPDX-License-Identifier: GPL-3.0-or-later
// Reads uploads from a gRPC stream: all calls with one share it.
#pragma once

#include <string>

#include "common/protocol.h"
#include "common/wire_vector.h"
#include "core/base/return_if_error.h"
#include "server/catalog/scan_upload.h"
#include "server/rpc/request.h"

namespace shapedb::rpc {

/// Calls `take(message)` with each message of an upload until the client has sent all. Errors: those of
/// `take` and of Upload::next; kUnauthenticated (the key was revoked meanwhile); kCancelled,
/// kDeadlineExceeded.
template <typename Message, typename Take>
Result<void> receiveMessages(const Services& services, Upload<Message>& messages, Call& call, Take&& take) {
    for (;;) {
        const auto message = messages.next(call, services.admission.requests);
        RETURN_IF_ERROR(message);
        if (*message == nullptr) break;
        RETURN_IF_ERROR(call.run().checkpoint());
        RETURN_IF_ERROR(call.authorization().requireStill());
        RETURN_IF_ERROR(take(**message));
    }
    // They also end when the client has gone: then the upload is not complete.
    if (call.clientGone()) return fail(ErrorCode::kCancelled, "the client cancelled the upload");
    return call.authorization().requireStill();
}

/// The same with messages that have a header or a chunk. Errors: kMalformedStream (neither of the two), too.
template <typename Message, typename Take>
Result<void> receiveHeaderAndChunks(const Services& services, Upload<Message>& messages, Call& call,
                                    Take&& take) {
    return receiveMessages(services, messages, call, [&](const Message& message) -> Result<void> {
        if (message.has_header() || message.has_chunk()) return take(message);
        return fail(ErrorCode::kMalformedStream, "message with neither header nor chunk");
    });
}

/// One chunk of an upload. Errors: those of ScanUpload::add.
inline Result<void> receiveChunk(const std::string& xyz, catalog::ScanUpload& upload, Call& call) {
    RETURN_IF_ERROR(upload.add(xyz));
    call.addPoints(xyz.size() / kPointBytes, xyz.size());
    return {};
}

[[nodiscard]] inline IsolateOptions isolationFrom(const v1::Isolation& message) {
    return {message.drop_plane(), message.largest_object()};
}

/// `onHeader(header)` checks the other fields of the header as soon as it arrives, so that a hopeless
/// upload is refused before its points are sent. What the header's isolation leaves out is gone. Errors:
/// those of ScanUpload, of isolated and of `onHeader`; kCancelled, kDeadlineExceeded.
template <typename Message, typename OnHeader>
Result<store::VerifiedScan> receiveScan(const Services& services, Upload<Message>& messages,
                                        catalog::ScanUpload& upload, Call& call, OnHeader&& onHeader) {
    IsolateOptions isolation;
    const auto take = [&](const Message& message) -> Result<void> {
        if (message.has_chunk()) return receiveChunk(message.chunk().xyz(), upload, call);
        const auto& header = message.header();
        // First, since it asks whether the caller may.
        RETURN_IF_ERROR(onHeader(header));
        RETURN_IF_ERROR(
            upload.begin(header.point_count(), header.sha256(), wire::fromProto(header.origin())));
        isolation = isolationFrom(header.isolation());
        return call.useScan(header.point_count());
    };
    RETURN_IF_ERROR(receiveHeaderAndChunks(services, messages, call, take));
    auto scan = upload.finish();
    RETURN_IF_ERROR(scan);
    auto isolated = catalog::isolated(std::move(*scan), isolation, call.run());
    RETURN_IF_ERROR(isolated);
    // Isolating takes a while, and then the scan may be stored.
    RETURN_IF_ERROR(call.authorization().requireStill());
    return isolated;
}

}  // namespace shapedb::rpc
