// SPDX-License-Identifier: GPL-3.0-or-later
// The part of AdminService that concerns API keys.
#include "core/base/return_if_error.h"
#include "server/rpc/admin_service.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"

namespace shapedb::rpc {
namespace {

Result<security::Role> roleFrom(v1::Role role) {
    switch (role) {
        case v1::ROLE_READER: return security::Role::kReader;
        case v1::ROLE_WRITER: return security::Role::kWriter;
        case v1::ROLE_ADMIN: return security::Role::kAdmin;
        default: return fail(ErrorCode::kInvalidArgument, "role: give READER, WRITER or ADMIN");
    }
}

v1::Role protoOf(security::Role role) {
    switch (role) {
        case security::Role::kReader: return v1::ROLE_READER;
        case security::Role::kWriter: return v1::ROLE_WRITER;
        case security::Role::kAdmin: return v1::ROLE_ADMIN;
    }
    return v1::ROLE_UNSPECIFIED;
}

Result<security::KeySpec> specFrom(const v1::CreateKeyRequest& request) {
    const auto role = roleFrom(request.role());
    RETURN_IF_ERROR(role);
    security::KeySpec spec;
    spec.name = request.name();
    spec.role = *role;
    spec.collections.assign(request.collections().begin(), request.collections().end());
    if (request.has_expires()) spec.expires = fromProto(request.expires());
    spec.limits = {request.limits().calls_per_second(), request.limits().scans_per_day(),
                   request.limits().bytes_per_day()};
    return spec;
}

void keyToProto(const security::Key& key, const security::KeyUsage& today, v1::Key* out) {
    out->set_id(key.id);
    out->set_name(key.spec.name);
    out->set_role(protoOf(key.spec.role));
    for (const std::string& collection : key.spec.collections) out->add_collections(collection);
    const security::KeyLimits& limits = key.spec.limits;
    if (limits.callsPerSecond > 0 || limits.scansPerDay > 0 || limits.bytesPerDay > 0) {
        out->mutable_limits()->set_calls_per_second(limits.callsPerSecond);
        out->mutable_limits()->set_scans_per_day(limits.scansPerDay);
        out->mutable_limits()->set_bytes_per_day(limits.bytesPerDay);
    }
    toProto(key.created, out->mutable_created());
    if (key.spec.expires) toProto(*key.spec.expires, out->mutable_expires());
    if (key.revoked) toProto(*key.revoked, out->mutable_revoked());
    out->set_scans_today(today.scans);
    out->set_bytes_today(today.bytes);
}

/// What an auditor wants to know of a key that was made or revoked.
void noteKeyOfCall(Call& call, const security::Key& key) {
    call.note({"api_key", key.id});
    call.note({"api_key_name", key.spec.name});
    call.note({"role", std::string(security::roleName(key.spec.role))});
}

}  // namespace

grpc::Status AdminServiceHandler::createKey(grpc::ServerContext* context,
                                            Request<v1::CreateKeyRequest>& request,
                                            v1::CreateKeyResponse* response) {
    return handle(services_, context, operations::kCreateKey, request, [&](Call& call) -> Result<void> {
        const auto spec = specFrom(*request);
        RETURN_IF_ERROR(spec);
        const auto created = services_.access.keyring.create(*spec);
        RETURN_IF_ERROR(created);
        noteKeyOfCall(call, created->key);
        keyToProto(created->key, {}, response->mutable_key());
        response->set_secret(created->text);
        return {};
    });
}

grpc::Status AdminServiceHandler::listKeys(grpc::ServerContext* context,
                                           Request<v1::ListKeysRequest>& request,
                                           v1::ListKeysResponse* response) {
    return handle(services_, context, operations::kListKeys, request, [&](Call&) -> Result<void> {
        const auto keys = services_.access.keyring.list();
        RETURN_IF_ERROR(keys);
        for (const security::KeyStatus& status : *keys)
            keyToProto(status.key, status.today, response->add_keys());
        return {};
    });
}

grpc::Status AdminServiceHandler::revokeKey(grpc::ServerContext* context,
                                            Request<v1::RevokeKeyRequest>& request,
                                            v1::RevokeKeyResponse* response) {
    return handle(services_, context, operations::kRevokeKey, request, [&](Call& call) -> Result<void> {
        const auto key = services_.access.keyring.revoke(request->id());
        RETURN_IF_ERROR(key);
        noteKeyOfCall(call, *key);
        keyToProto(*key, {}, response->mutable_key());
        return {};
    });
}

}  // namespace shapedb::rpc
