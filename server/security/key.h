// SPDX-License-Identifier: GPL-3.0-or-later
// API keys: who a caller is, and what it may do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/sha256.h"
#include "core/base/error.h"
#include "server/security/operation.h"

namespace shapedb::security {

/// Milliseconds since 1970 (UTC).
using UnixMs = std::int64_t;

constexpr std::size_t kMaxNameBytes = 128;      ///< of a key's name
constexpr std::size_t kMaxCollections = 1'000;  ///< that a key names

/// What the holder of a key may use; 0: without limit.
struct KeyLimits {
    std::uint32_t callsPerSecond = 0;  ///< on average; as many may come at once
    std::uint64_t scansPerDay = 0;     ///< received; days begin at midnight UTC
    std::uint64_t bytesPerDay = 0;     ///< of points received
};

/// A request for a new key.
struct KeySpec {
    std::string name;  ///< for people; several keys may share it
    Role role = Role::kReader;
    std::vector<std::string> collections;  ///< that it may use, existing or not; empty: all
    std::optional<UnixMs> expires;         ///< empty: never
    KeyLimits limits;
};

struct Key {
    std::string id;  ///< names the key in logs; not a secret
    KeySpec spec;
    Sha256Digest secretSha256{};
    UnixMs created = 0;
    std::optional<UnixMs> revoked;

    [[nodiscard]] bool isUsable(UnixMs now) const {
        return !revoked && (!spec.expires || now < *spec.expires);
    }
};

/// What a key has used on a day.
struct KeyUsage {
    std::int64_t day = 0;  ///< since 1970 (UTC)
    std::uint64_t scans = 0;
    std::uint64_t bytes = 0;
};

/// "reader", "writer", "admin".
[[nodiscard]] const char* roleName(Role role) noexcept;
/// Errors: kInvalidArgument.
[[nodiscard]] Result<Role> roleFromName(const std::string& name);

/// Errors: kInvalidArgument (the name is not 1 to kMaxNameBytes of safe UTF-8; more than kMaxCollections, or
/// one with a name that no collection can have; an expiry that is not after `now`, or after the year 9999).
[[nodiscard]] Result<void> validate(const KeySpec& spec, UnixMs now);

/// The whole key, as a client sends it: "shapedb_ID_SECRET", both in hexadecimal digits.
struct ApiKey {
    std::string id;      ///< 8 random bytes
    std::string secret;  ///< 32 random bytes

    [[nodiscard]] std::string text() const;
};

/// 32 random bytes of the operating system, in hexadecimal digits. Errors: kInternal (it has none).
[[nodiscard]] Result<std::string> makeSecret();
/// From the operating system's random numbers. Errors: kInternal (it has none).
[[nodiscard]] Result<ApiKey> makeApiKey();
/// Empty if `text` has another form.
[[nodiscard]] std::optional<ApiKey> parseApiKey(const std::string& text);
/// What is stored of a secret. 256 random bits need no salt and no slow hash: nobody can try them all.
[[nodiscard]] Sha256Digest hashOf(const ApiKey& key);
/// Takes the same time wherever the two differ.
[[nodiscard]] bool equalInConstantTime(const Sha256Digest& a, const Sha256Digest& b) noexcept;

}  // namespace shapedb::security
