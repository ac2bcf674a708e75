// SPDX-License-Identifier: Apache-2.0
#include "client/api/request_text.h"

#include <string>
#include <vector>

#include <google/protobuf/descriptor.h>

#include "common/safe_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

Result<void> requireText(const FieldDescriptor& field, const std::string& text) {
    if (isUtf8(text)) return {};
    return fail(ErrorCode::kInvalidArgument,
                "the " + std::string(field.name()) + " '" + escapeUnsafe(text) +
                    "' is not UTF-8, which all text must be: rename it, or choose "
                    "another");
}

Result<void> requireField(const Message& message, const FieldDescriptor& field) {
    const Reflection& values = *message.GetReflection();
    const int count = field.is_repeated() ? values.FieldSize(message, &field) : 1;
    for (int i = 0; i < count; ++i) {
        if (field.type() == FieldDescriptor::TYPE_STRING) {
            std::string scratch;
            RETURN_IF_ERROR(requireText(
                field, field.is_repeated() ? values.GetRepeatedStringReference(message, &field, i, &scratch)
                                           : values.GetStringReference(message, &field, &scratch)));
        } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
            RETURN_IF_ERROR(requireUtf8(field.is_repeated() ? values.GetRepeatedMessage(message, &field, i)
                                                            : values.GetMessage(message, &field)));
        }
    }
    return {};
}

}  // namespace

Result<void> requireUtf8(const Message& request) {
    std::vector<const FieldDescriptor*> fields;
    request.GetReflection()->ListFields(request, &fields);
    for (const FieldDescriptor* field : fields) RETURN_IF_ERROR(requireField(request, *field));
    return {};
}

}  // namespace shapedb::client
