// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/authorization.h"

#include <algorithm>
#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::security {
namespace {

tl::unexpected<Error> denied(const Key& key, const std::string& why) {
    return fail(ErrorCode::kPermissionDenied, "the API key '" + key.spec.name + "' " + why);
}

}  // namespace

Result<void> Authorization::begin(const Credentials& credentials) {
    RETURN_IF_ERROR(authenticate(credentials));
    if (!holder_) return {};
    RETURN_IF_ERROR(spend(holder_->takeCall(policy_.keyring.clock().monotonic())));
    return requireRole();
}

Result<void> Authorization::authenticate(const Credentials& credentials) {
    if (!credentials.key.empty()) {
        auto holder = policy_.keyring.find(credentials.key);
        RETURN_IF_ERROR(holder);
        holder_ = std::move(*holder);
        return {};
    }
    if (credentials.localAdmin) return {};
    if (policy_.keysRequired) {
        return fail(ErrorCode::kUnauthenticated,
                    "this server wants an API key: shapedb takes it with --key-file or from "
                    "SHAPEDB_API_KEY_FILE, other programs send 'authorization: Bearer KEY'");
    }
    if (operation_.scope == Scope::kKeys) {
        return fail(
            ErrorCode::kUnauthenticated,
            "API keys are made, listed and revoked with an admin key, through the server's Unix socket, or "
            "on its machine with 'shapedbd key'");
    }
    return {};
}

Result<void> Authorization::requireRole() const {
    const Key& key = holder_->key();
    if (key.spec.role < operation_.role) {
        return denied(key, std::string("has the role ") + roleName(key.spec.role) + "; " + operation_.name +
                               " needs the role " + roleName(operation_.role));
    }
    const bool wholeServer = operation_.scope == Scope::kServer || operation_.scope == Scope::kKeys;
    if (wholeServer && !key.spec.collections.empty()) {
        return denied(
            key, std::string("is for some collections; ") + operation_.name + " needs a key for all of them");
    }
    return {};
}

Result<void> Authorization::useCollection(const std::string& name) {
    usedCollection_ = true;
    if (sees(name)) return {};
    return denied(holder_->key(), "is not for collection '" + name + "'");
}

Result<void> Authorization::useAllCollections() {
    usedCollection_ = true;
    if (!holder_ || holder_->key().spec.collections.empty()) return {};
    return denied(holder_->key(), "is for some collections: name one of them");
}

bool Authorization::sees(const std::string& collection) const {
    if (!holder_) return true;
    const auto& allowed = holder_->key().spec.collections;
    return allowed.empty() || std::find(allowed.begin(), allowed.end(), collection) != allowed.end();
}

Result<void> Authorization::useScan(std::uint64_t bytes) {
    if (!holder_) return {};
    announcedAt_ = policy_.keyring.clock().wall();
    RETURN_IF_ERROR(spend(holder_->takeScan(bytes, announcedAt_)));
    announced_ += bytes;
    return {};
}

void Authorization::endScans(std::uint64_t arrived) {
    const std::uint64_t announced = std::exchange(announced_, 0);
    if (announced > arrived) holder_->giveBack(announced - arrived, announcedAt_);
}

Result<void> Authorization::requireStill() const {
    return holder_ ? policy_.keyring.requireUsable(*holder_) : Result<void>();
}

std::function<Result<void>()> Authorization::stillAllowed() const {
    if (!holder_) return nullptr;
    return [&keyring = policy_.keyring, holder = holder_] { return keyring.requireUsable(*holder); };
}

Result<void> Authorization::spend(tl::expected<void, Refusal> taken) {
    if (taken) return {};
    retryAfter_ = taken.error().retryAfter;
    return fail(std::move(taken.error().error));
}

Result<void> Authorization::settle(Result<void> result) const {
    if (!result || operation_.scope != Scope::kCollections || usedCollection_) return result;
    return fail(ErrorCode::kInternal,
                std::string(operation_.name) + " answered without asking which collection it may use");
}

}  // namespace shapedb::security
