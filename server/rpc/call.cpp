// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/call.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include <grpc/grpc_security_constants.h>

#include "common/sha256.h"
#include "core/base/return_if_error.h"
#include "server/catalog/limits.h"
#include "server/catalog/request_checks.h"
#include "server/rpc/inside.h"
#include "server/rpc/status.h"
#include "server/security/key.h"

namespace shapedb::rpc {

namespace {

RunContext::Clock::time_point steadyDeadline(const grpc::ServerContext& context) {
    using System = std::chrono::system_clock;
    const System::time_point deadline = context.deadline();
    const auto left = deadline - System::now();
    // "Never" is a moment centuries away for gRPC; adding it to `now` could overflow.
    if (deadline == System::time_point::max() || left > std::chrono::hours(24 * 365)) {
        return RunContext::Clock::time_point::max();
    }
    return RunContext::Clock::now() + std::chrono::duration_cast<RunContext::Clock::duration>(left);
}

const char* statusName(grpc::StatusCode code) {
    switch (code) {
        case grpc::StatusCode::OK: return "OK";
        case grpc::StatusCode::CANCELLED: return "CANCELLED";
        case grpc::StatusCode::INVALID_ARGUMENT: return "INVALID_ARGUMENT";
        case grpc::StatusCode::DEADLINE_EXCEEDED: return "DEADLINE_EXCEEDED";
        case grpc::StatusCode::NOT_FOUND: return "NOT_FOUND";
        case grpc::StatusCode::ALREADY_EXISTS: return "ALREADY_EXISTS";
        case grpc::StatusCode::RESOURCE_EXHAUSTED: return "RESOURCE_EXHAUSTED";
        case grpc::StatusCode::PERMISSION_DENIED: return "PERMISSION_DENIED";
        case grpc::StatusCode::UNAUTHENTICATED: return "UNAUTHENTICATED";
        case grpc::StatusCode::FAILED_PRECONDITION: return "FAILED_PRECONDITION";
        case grpc::StatusCode::ABORTED: return "ABORTED";
        case grpc::StatusCode::OUT_OF_RANGE: return "OUT_OF_RANGE";
        case grpc::StatusCode::UNAVAILABLE: return "UNAVAILABLE";
        case grpc::StatusCode::DATA_LOSS: return "DATA_LOSS";
        case grpc::StatusCode::INTERNAL: return "INTERNAL";
        default: return "UNKNOWN";
    }
}

telemetry::Level levelOf(grpc::StatusCode code) {
    switch (code) {
        case grpc::StatusCode::INTERNAL:
        case grpc::StatusCode::DATA_LOSS: return telemetry::Level::kError;
        case grpc::StatusCode::RESOURCE_EXHAUSTED:
        case grpc::StatusCode::UNAVAILABLE: return telemetry::Level::kWarn;
        default: return telemetry::Level::kInfo;
    }
}

/// What follows "Bearer " in the metadata `authorization`; empty if there is none.
std::string keyPresented(const grpc::ServerContext& context) {
    constexpr std::string_view kScheme = "bearer ";
    const auto& metadata = context.client_metadata();
    const auto found = metadata.find("authorization");
    if (found == metadata.end()) return {};
    const std::string_view value(found->second.data(), found->second.size());
    const auto sameLetter = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
    const bool bearer = value.size() > kScheme.size() &&
                        std::equal(kScheme.begin(), kScheme.end(), value.begin(),
                                   [&](char wanted, char given) { return sameLetter(given, wanted); });
    // Another scheme is no key either, and is told so.
    return std::string(bearer ? value.substr(kScheme.size()) : value);
}

/// So that the log line of a call can be found from the client's. Of several headers none counts.
std::optional<std::string> traceOf(const grpc::ServerContext& context) {
    const auto [first, last] = context.client_metadata().equal_range("traceparent");
    if (first == last || std::next(first) != last) return std::nullopt;
    return traceIdOf({first->second.data(), first->second.size()});
}

std::string metadatum(const grpc::ServerContext& context, const char* key) {
    const auto found = context.client_metadata().find(key);
    if (found == context.client_metadata().end()) return {};
    return {found->second.data(), found->second.size()};
}

/// Strangers may send anything; only this process knows the secret.
bool comesFromInside(const grpc::ServerContext& context, const std::string& secret) {
    const std::string shown = metadatum(context, kInsideKey);
    if (shown.empty()) return false;
    const auto digest = [](const std::string& text) { return sha256(text.data(), text.size()); };
    return security::equalInConstantTime(digest(shown), digest(secret));
}

}  // namespace

Call::Call(const Services& services, grpc::ServerContext& context, const security::Operation& operation)
    : services_(services),
      context_(context),
      operation_(operation),
      inside_(comesFromInside(context, services.insideSecret)),
      peer_(inside_ ? metadatum(context, kPeerKey) : context.peer()),
      began_(std::chrono::steady_clock::now()),
      cancellation_(services.cancellations, context),
      frame_(services.catalog, services.admission, run_),
      authorization_(services.access, operation) {
    run_.cancel = &cancellation_.flag();
    run_.deadline = steadyDeadline(context);
}

security::Credentials Call::credentials() const {
    security::Credentials credentials;
    credentials.key = keyPresented(context_);
    const auto kind = context_.auth_context()->FindPropertyValues(GRPC_TRANSPORT_SECURITY_TYPE_PROPERTY_NAME);
    // Given by gRPC to connections at the Unix socket, and to no others.
    credentials.localAdmin = !inside_ && !kind.empty() && kind.front() == "local";
    return credentials;
}

Result<void> Call::begin() {
    RETURN_IF_ERROR(authorization_.begin(credentials()));
    if (auto still = authorization_.stillAllowed()) cancellation_.guard(std::move(still));
    return frame_.admit(operation_.callClass);
}

Result<std::string> Call::useCollection(const std::string& name) {
    collection_ = services_.catalog.nameOf(name);
    // A key for an alias may use what it stands for. The error tells no more than the caller knew.
    const std::string asked = catalog::collectionNameOrDefault(name);
    RETURN_IF_ERROR(authorization_.useCollection(authorization_.sees(collection_) ? collection_ : asked));
    return collection_;
}

Result<void> Call::useScan(std::uint64_t points) {
    return authorization_.useScan(points * catalog::kPointBytes);
}

Result<index::SnapshotPtr> Call::collection(const std::string& name) {
    const auto own = useCollection(name);
    RETURN_IF_ERROR(own);
    return services_.catalog.collection(*own);
}

Result<catalog::FoundShape> Call::shape(const v1::ShapeRef& ref) {
    noteKey(ref.key());
    const auto found = collection(ref.collection());
    RETURN_IF_ERROR(found);
    return services_.catalog.findShape(*found, ref.key());
}

grpc::Status Call::finish(Result<void> result) {
    authorization_.endScans(bytes_);
    result = frame_.settle(authorization_.settle(std::move(result)), cancellation_.end());
    const auto hint = authorization_.retryAfter() ? authorization_.retryAfter() : frame_.retryHint();
    const grpc::Status status = result ? grpc::Status::OK : makeStatus(result.error(), context_, hint);
    logLine(status, result ? nullptr : &result.error());
    return status;
}

void Call::noteUnreadAnswer() {
    const auto why = cancellation_.end();
    if (!why) return;
    info("the answer of a call was not read",
         {{"rpc", std::string(operation_.name)}, {"peer", peer_}, {"reason", why->message}});
}

void Call::info(const std::string& message, std::vector<telemetry::Field> fields) const {
    if (const auto trace = traceOf(context_)) fields.push_back({"trace", *trace});
    services_.log->info(message, fields);
}

void Call::logLine(const grpc::Status& status, const Error* error) {
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began_;
    services_.metrics.recordCall(operation_.name, statusName(status.error_code()), took.count() / 1e3,
                                 bytes_);
    std::vector<telemetry::Field> fields = {{"rpc", std::string(operation_.name)},
                                            {"peer", peer_},
                                            {"code", std::string(statusName(status.error_code()))},
                                            {"ms", took.count()}};
    if (inside_) fields.push_back({"via", std::string("http")});
    if (const auto trace = traceOf(context_)) fields.push_back({"trace", *trace});
    if (const std::string key = authorization_.keyId(); !key.empty()) {
        fields.push_back({"caller", key});
        fields.push_back({"caller_name", authorization_.keyName()});
    }
    if (!collection_.empty()) fields.push_back({"collection", collection_});
    fields.insert(fields.end(), notes_.begin(), notes_.end());
    if (points_ > 0) fields.push_back({"points", points_});
    if (bytes_ > 0) fields.push_back({"bytes", bytes_});
    if (error != nullptr) {
        for (telemetry::Field& field : telemetry::fieldsOf(*error)) fields.push_back(std::move(field));
    }
    services_.log->log(levelOf(status.error_code()), "call", fields);
    if (status.error_code() == grpc::StatusCode::UNAUTHENTICATED ||
        status.error_code() == grpc::StatusCode::PERMISSION_DENIED) {
        services_.audit.recordRefusal(std::move(fields));
    } else if (operation_.role == security::Role::kAdmin) {
        services_.audit.recordAdministration(fields);
    }
}

std::optional<std::string> traceIdOf(std::string_view traceparent) {
    constexpr std::size_t kTraceAt = 3, kTraceDigits = 32, kParentAt = 36, kParentDigits = 16, kBytes = 55;
    if (traceparent.size() < kBytes) return std::nullopt;
    for (std::size_t i = 0; i < kBytes; ++i) {
        const bool dash = i == kTraceAt - 1 || i == kParentAt - 1 || i == kParentAt + kParentDigits;
        const bool digit =
            std::string_view("0123456789abcdef").find(traceparent[i]) != std::string_view::npos;
        if (dash ? traceparent[i] != '-' : !digit) return std::nullopt;
    }
    const std::string_view version = traceparent.substr(0, kTraceAt - 1);
    const bool ends = traceparent.size() == kBytes;
    if (version == "ff" || (version == "00" && !ends) || (!ends && traceparent[kBytes] != '-'))
        return std::nullopt;
    const std::string_view trace = traceparent.substr(kTraceAt, kTraceDigits);
    const std::string_view parent = traceparent.substr(kParentAt, kParentDigits);
    const auto allZero = [](std::string_view text) {
        return text.find_first_not_of('0') == std::string_view::npos;
    };
    if (allZero(trace) || allZero(parent)) return std::nullopt;
    return std::string(trace);
}

}  // namespace shapedb::rpc
