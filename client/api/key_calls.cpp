// SPDX-License-Identifier: Apache-2.0
// The part of AdminService that concerns API keys.
#include "client/api/call.h"
#include "client/api/client.h"
#include "client/api/convert.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

v1::Role roleToWire(Role role) {
    switch (role) {
        case Role::kReader: return v1::ROLE_READER;
        case Role::kWriter: return v1::ROLE_WRITER;
        case Role::kAdmin: return v1::ROLE_ADMIN;
    }
    return v1::ROLE_UNSPECIFIED;
}

Role roleFromWire(v1::Role role) {
    switch (role) {
        case v1::ROLE_ADMIN: return Role::kAdmin;
        case v1::ROLE_WRITER: return Role::kWriter;
        default: return Role::kReader;
    }
}

Key keyFromWire(const v1::Key& from) {
    Key key;
    key.id = from.id();
    key.name = from.name();
    key.role = roleFromWire(from.role());
    key.collections.assign(from.collections().begin(), from.collections().end());
    key.limits = {from.limits().calls_per_second(), from.limits().scans_per_day(),
                  from.limits().bytes_per_day()};
    key.created = fromWire(from.created());
    if (from.has_expires()) key.expires = fromWire(from.expires());
    if (from.has_revoked()) key.revoked = fromWire(from.revoked());
    key.scansToday = from.scans_today();
    key.bytesToday = from.bytes_today();
    return key;
}

}  // namespace

Result<CreatedKey> Client::createKey(const KeyRequest& request, const RunContext& context) const {
    v1::CreateKeyRequest message;
    message.set_name(request.name);
    message.set_role(roleToWire(request.role));
    for (const std::string& collection : request.collections) message.add_collections(collection);
    if (request.expires) *message.mutable_expires() = toWire(*request.expires);
    message.mutable_limits()->set_calls_per_second(request.limits.callsPerSecond);
    message.mutable_limits()->set_scans_per_day(request.limits.scansPerDay);
    message.mutable_limits()->set_bytes_per_day(request.limits.bytesPerDay);
    const auto response =
        callUnary(impl_->options, context, kOnce, *impl_->admin, &v1::AdminService::Stub::CreateKey, message);
    RETURN_IF_ERROR(response);
    return CreatedKey{keyFromWire(response->key()), response->secret()};
}

Result<std::vector<Key>> Client::listKeys(const RunContext& context) const {
    const auto response = callUnary(impl_->options, context, kIdempotent, *impl_->admin,
                                    &v1::AdminService::Stub::ListKeys, v1::ListKeysRequest());
    RETURN_IF_ERROR(response);
    std::vector<Key> keys;
    for (const v1::Key& key : response->keys()) keys.push_back(keyFromWire(key));
    return keys;
}

Result<Key> Client::revokeKey(const std::string& id, const RunContext& context) const {
    v1::RevokeKeyRequest message;
    message.set_id(id);
    const auto response =
        callUnary(impl_->options, context, kOnce, *impl_->admin, &v1::AdminService::Stub::RevokeKey, message);
    RETURN_IF_ERROR(response);
    return keyFromWire(response->key());
}

}  // namespace shapedb::client
