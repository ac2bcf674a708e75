// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/local_result.h"

#include "client/api/convert.h"
#include "common/wire.h"

namespace shapedb::cli {

namespace {

/// By way of the message a server would send.
template <typename Message, typename Value>
auto throughMessage(const Value& value) {
    Message message;
    wire::toProto(value, &message);
    return client::fromWire(message);
}

}  // namespace

client::Signature toClient(const Signature& signature) { return throughMessage<v1::Signature>(signature); }

client::Explanation toClient(const Explanation& explanation) {
    return throughMessage<v1::Explanation>(explanation);
}

client::Fit toClient(const FitResult& fit) { return throughMessage<v1::Fit>(fit); }

client::SegmentationReport toClient(const Segmentation& segmentation) {
    return throughMessage<v1::SegmentationReport>(segmentation);
}

}  // namespace shapedb::cli
