// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/methods.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver.h>
#include <google/protobuf/util/type_resolver_util.h>

#include "common/safe_text.h"
#include "server/rpc/health.h"

namespace shapedb::http {
namespace {

namespace protobuf = google::protobuf;

constexpr const char* kTypeUrl = "type.googleapis.com";
constexpr std::string_view kPackage = "/shapedb.v1.";
/// Of what protobuf says of bad JSON, which quotes it.
constexpr std::size_t kMostReasonBytes = 512;
constexpr int kMostNested = 32;

std::string typeUrl(const std::string& type) { return std::string(kTypeUrl) + "/" + type; }

Method methodOf(const protobuf::MethodDescriptor& descriptor) {
    Method method;
    method.path = "/" + descriptor.service()->full_name() + "/" + descriptor.name();
    method.requestType = descriptor.input_type()->full_name();
    method.responseType = descriptor.output_type()->full_name();
    method.clientStreams = descriptor.client_streaming();
    method.serverStreams = descriptor.server_streaming();
    return method;
}

/// Whether lists and objects nest deeper than those of any message. protobuf (3.21) takes some hundred bytes
/// for each level of lists and bounds them not at all. Its texts begin and end with either kind of quotes.
bool nestsTooDeep(std::string_view json) {
    int depth = 0;
    char quote = 0;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (quote != 0) {
            if (c == '\\') ++i;
            if (c == quote) quote = 0;
        } else if (c == '"' || c == '\'') {
            quote = c;
        } else if (c == '[' || c == '{') {
            if (++depth > kMostNested) return true;
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return false;
}

}  // namespace

Methods::Methods()
    : types_(protobuf::util::NewTypeResolverForDescriptorPool(kTypeUrl,
                                                              protobuf::DescriptorPool::generated_pool())) {
    for (const char* name : rpc::serviceNames()) {
        const auto* service = protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
        for (int i = 0; service != nullptr && i < service->method_count(); ++i) {
            const Method method = methodOf(*service->method(i));
            methods_.emplace(method.path, method);
        }
    }
}

Methods::~Methods() = default;

const Method* Methods::find(std::string_view path) const {
    const auto found = methods_.find(path);
    return found == methods_.end() ? nullptr : &found->second;
}

bool Methods::isCall(std::string_view path) { return path.substr(0, kPackage.size()) == kPackage; }

OrFailure<std::string> Methods::requestFromJson(const Method& method, std::string_view json) const {
    if (nestsTooDeep(json)) {
        return refuse(ErrorCode::kInvalidArgument, "the message is no JSON of " + method.requestType +
                                                       ": it nests more than " + std::to_string(kMostNested) +
                                                       " deep");
    }
    std::string bytes;
    const auto status = protobuf::util::JsonToBinaryString(types_.get(), typeUrl(method.requestType),
                                                           {json.data(), json.size()}, &bytes, {});
    if (status.ok()) return bytes;
    const std::string why(status.message().data(), status.message().size());
    return refuse(ErrorCode::kInvalidArgument, "the message is no JSON of " + method.requestType + ": " +
                                                   cutText(escapeUnsafe(why, true), kMostReasonBytes));
}

OrFailure<std::string> Methods::responseToJson(const Method& method, const std::string& bytes) const {
    std::string json;
    const auto status =
        protobuf::util::BinaryToJsonString(types_.get(), typeUrl(method.responseType), bytes, &json, {});
    if (status.ok()) return json;
    return refuse(ErrorCode::kInternal, "the answer cannot be written as JSON");
}

}  // namespace shapedb::http
