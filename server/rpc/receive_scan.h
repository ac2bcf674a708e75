// Reads an upload from a gRPC stream: AddShape, SearchByScan and Segment share it.
#pragma once

#include "common/point_stream.h"
#include "core/base/return_if_error.h"
#include "server/catalog/scan_upload.h"
#include "server/rpc/call.h"

namespace shapedb::rpc {

/// `onHeader(header)` checks the other fields of the header as soon as it arrives, so that a hopeless
/// upload is refused before its points are sent. What the header's isolation leaves out is gone. Errors:
/// those of ScanUpload, of isolated and of `onHeader`; kCancelled, kDeadlineExceeded.
template <typename Request, typename Reader, typename OnHeader>
Result<store::VerifiedScan> receiveScan(Reader& reader, catalog::ScanUpload& upload, Call& call,
                                        OnHeader&& onHeader) {
    Request request;
    IsolateOptions isolation;
    while (call.read(reader, &request)) {
        RETURN_IF_ERROR(call.run().checkpoint());
        Result<void> taken;
        if (request.has_header()) {
            taken = upload.begin(request.header().point_count(), request.header().sha256());
            isolation.dropPlane = request.header().isolation().drop_plane();
            isolation.largest = request.header().isolation().largest_object();
            if (taken) taken = onHeader(request.header());
        } else if (request.has_chunk()) {
            const std::string& xyz = request.chunk().xyz();
            taken = upload.add(xyz);
            if (taken) call.addPoints(xyz.size() / kPointBytes, xyz.size());
        } else {
            taken = fail(ErrorCode::kMalformedStream, "message with neither header nor chunk");
        }
        RETURN_IF_ERROR(taken);
    }
    // `Read` also returns false when the client has gone: then the upload is not complete.
    if (call.clientGone()) return fail(ErrorCode::kCancelled, "the client cancelled the upload");
    auto scan = upload.finish();
    RETURN_IF_ERROR(scan);
    return catalog::isolated(std::move(*scan), isolation, call.run());
}

}  // namespace shapedb::rpc
