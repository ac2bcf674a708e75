// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/message_bytes.h"

#include <cstdint>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpc/slice.h>
#include <grpcpp/support/proto_buffer_reader.h>

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

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

constexpr int kMostPlainFields = 16;

/// Also bounds how deep messages are in messages: each takes one of `fieldsLeft`.
bool hasFewFields(CodedInputStream& in, const Descriptor& type, int& fieldsLeft) {
    while (const std::uint32_t tag = in.ReadTag()) {
        const FieldDescriptor* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
        if (field == nullptr || fieldsLeft-- == 0) return false;
        if (WireFormatLite::GetTagWireType(tag) != WireFormatLite::WIRETYPE_LENGTH_DELIMITED ||
            field->cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
            if (!WireFormatLite::SkipField(&in, tag)) return false;
            continue;
        }
        std::uint32_t size = 0;
        if (field->message_type() == nullptr || !in.ReadVarint32(&size)) return false;
        const auto outer = in.PushLimit(static_cast<int>(size));
        if (!hasFewFields(in, *field->message_type(), fieldsLeft) || in.BytesUntilLimit() != 0) return false;
        if (!in.CheckEntireMessageConsumedAndPopLimit(outer)) return false;
    }
    return true;
}

}  // namespace

bool isPlain(const grpc::ByteBuffer& message, const Descriptor& type) {
    grpc::ByteBuffer bytes = message;  // another reference to the same bytes
    grpc::ProtoBufferReader reader(&bytes);
    if (!reader.status().ok()) return false;
    CodedInputStream in(&reader);
    int fieldsLeft = kMostPlainFields;
    return hasFewFields(in, type, fieldsLeft) && in.ConsumedEntireMessage();
}

}  // namespace shapedb::rpc
