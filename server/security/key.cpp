// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/key.h"

#include <algorithm>
#include <array>

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include "common/api_key_text.h"
#include "common/safe_text.h"
#include "core/base/return_if_error.h"
#include "server/store/key_rules.h"

namespace shapedb::security {
namespace {

constexpr std::size_t kIdBytes = kApiKeyIdDigits / 2;
constexpr std::size_t kSecretBytes = kApiKeySecretDigits / 2;

Result<std::string> randomHex(std::size_t bytes) {
    std::array<unsigned char, kSecretBytes> random{};
    if (RAND_bytes(random.data(), static_cast<int>(bytes)) != 1) {
        return fail(ErrorCode::kInternal, "the operating system gives no random numbers");
    }
    std::string text = toHex(random.data(), bytes);
    OPENSSL_cleanse(random.data(), random.size());
    return text;
}

bool isHex(const std::string& text) {
    return text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

}  // namespace

const char* roleName(Role role) noexcept {
    switch (role) {
        case Role::kReader: return "reader";
        case Role::kWriter: return "writer";
        case Role::kAdmin: return "admin";
    }
    return "reader";
}

Result<Role> roleFromName(const std::string& name) {
    for (const Role role : {Role::kReader, Role::kWriter, Role::kAdmin}) {
        if (name == roleName(role)) return role;
    }
    return fail(ErrorCode::kInvalidArgument, "unknown role '" + name + "'; use reader, writer or admin");
}

Result<void> validate(const KeySpec& spec, UnixMs now) {
    if (spec.name.empty() || spec.name.size() > kMaxNameBytes || findUnsafe(spec.name) != std::string::npos) {
        return fail(ErrorCode::kInvalidArgument,
                    "the name of a key must be 1 to " + std::to_string(kMaxNameBytes) +
                        " bytes of UTF-8 without control and invisible characters");
    }
    if (spec.collections.size() > kMaxCollections) {
        return fail(ErrorCode::kInvalidArgument,
                    "a key names " + std::to_string(spec.collections.size()) + " collections, at most " +
                        std::to_string(kMaxCollections) + "; leave them out for a key of all collections");
    }
    for (const std::string& collection : spec.collections) {
        if (const auto problem = store::problemOfCollectionName(collection)) {
            return fail(ErrorCode::kInvalidArgument, "collection '" + collection + "': " + *problem);
        }
    }
    if (spec.expires && *spec.expires <= now) {
        return fail(ErrorCode::kInvalidArgument, "the key would have expired before it exists");
    }
    if (spec.expires && *spec.expires > store::kLastMoment) {
        return fail(ErrorCode::kInvalidArgument,
                    "the key would expire after the year 9999: leave the expiry out for one that never does");
    }
    return {};
}

std::string ApiKey::text() const { return std::string(kApiKeyPrefix) + id + "_" + secret; }

Result<std::string> makeSecret() { return randomHex(kSecretBytes); }

Result<ApiKey> makeApiKey() {
    auto id = randomHex(kIdBytes);
    RETURN_IF_ERROR(id);
    auto secret = makeSecret();
    RETURN_IF_ERROR(secret);
    return ApiKey{std::move(*id), std::move(*secret)};
}

std::optional<ApiKey> parseApiKey(const std::string& text) {
    const std::size_t underscore = kApiKeyPrefix.size() + kApiKeyIdDigits;
    if (text.size() != underscore + 1 + kApiKeySecretDigits ||
        text.compare(0, kApiKeyPrefix.size(), kApiKeyPrefix) != 0 || text[underscore] != '_') {
        return std::nullopt;
    }
    ApiKey key{text.substr(kApiKeyPrefix.size(), kApiKeyIdDigits), text.substr(underscore + 1)};
    if (!isHex(key.id) || !isHex(key.secret)) return std::nullopt;
    return key;
}

Sha256Digest hashOf(const ApiKey& key) { return sha256(key.secret.data(), key.secret.size()); }

bool equalInConstantTime(const Sha256Digest& a, const Sha256Digest& b) noexcept {
    return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace shapedb::security
