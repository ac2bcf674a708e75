// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/batch_answer.h"

#include <cstdint>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpc/slice.h>

namespace shapedb::rpc {

void BatchAnswer::set(std::size_t i, const shapedb::v1::SearchResponse& response) {
    using google::protobuf::internal::WireFormatLite;
    using google::protobuf::io::CodedOutputStream;
    // A message within another: its field number and kind, its size, its bytes.
    const std::uint32_t tag = WireFormatLite::MakeTag(shapedb::v1::SearchBatchResponse::kResponsesFieldNumber,
                                                      WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
    const auto size = static_cast<std::uint32_t>(response.ByteSizeLong());
    grpc_slice slice = grpc_slice_malloc(CodedOutputStream::VarintSize32(tag) +
                                         CodedOutputStream::VarintSize32(size) + size);
    std::uint8_t* end = GRPC_SLICE_START_PTR(slice);
    end = CodedOutputStream::WriteVarint32ToArray(tag, end);
    end = CodedOutputStream::WriteVarint32ToArray(size, end);
    response.SerializeWithCachedSizesToArray(end);
    encoded_[i] = grpc::Slice(slice, grpc::Slice::STEAL_REF);
}

}  // namespace shapedb::rpc
