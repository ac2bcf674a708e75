// Sends a packed scan. Private to client/api.
#pragma once

#include <algorithm>

#include "client/api/packing.h"
#include "core/base/run_context.h"

namespace shapedb::client {

/// Writes `header`, then the points in chunks. Stops early if the server has already answered; the status of
/// the call then says why. `Request` has the oneof {header, chunk}.
template <typename Request, typename Stream>
void writeScan(Stream& stream, const Request& header, const PackedPoints& points, const RunContext& context) {
    if (!stream.Write(header)) return;
    for (std::size_t at = 0; at < points.bytes.size(); at += kChunkBytes) {
        const std::size_t size = std::min(kChunkBytes, points.bytes.size() - at);
        Request message;
        message.mutable_chunk()->set_xyz(points.bytes.data() + at, size);
        if (!stream.Write(message)) return;
        context.report("upload", at + size, points.bytes.size());
    }
    stream.WritesDone();
}

}  // namespace shapedb::client
