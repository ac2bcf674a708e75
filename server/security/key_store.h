// SPDX-License-Identifier: GPL-3.0-or-later
// Where API keys are kept. Apart from the shapes: a backup holds no keys, and restoring an old one revives
// none.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/security/key.h"

namespace shapedb::security {

/// Thread-safe; several processes may have the same keys open. Changes are durable when a function returns.
/// Errors of all functions: kStorage, kStorageFull, kDataLoss, kOutOfMemory.
class KeyStore {
  public:
    virtual ~KeyStore() = default;

    virtual Result<void> insert(const Key& key) = 0;
    /// All, the oldest first.
    virtual Result<std::vector<Key>> list() = 0;
    /// Returns the key as it is now. Errors: kNotFound (no such key, or revoked before).
    virtual Result<Key> revoke(const std::string& id, UnixMs now) = 0;
    /// Changes when another KeyStore, in this process or another, has changed the keys.
    virtual Result<std::int64_t> version() = 0;

    /// By id, of the keys that have been used.
    virtual Result<std::map<std::string, KeyUsage>> usage() = 0;
    virtual Result<void> saveUsage(const std::map<std::string, KeyUsage>& usage) = 0;
};

}  // namespace shapedb::security
