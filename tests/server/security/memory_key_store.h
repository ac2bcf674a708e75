// SPDX-License-Identifier: GPL-3.0-or-later
// API keys in memory, as a plain reference of security::KeyStore.
#pragma once

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/security/key_store.h"

namespace shapedb::security {

/// What several stores of one file share.
struct KeyTable {
    std::mutex mutex;
    std::vector<Key> keys;
    std::map<std::string, KeyUsage> usage;
    std::int64_t changes = 0;
    std::optional<Error> fault;  ///< of every function while it is set
};

class MemoryKeyStore final : public KeyStore {
  public:
    explicit MemoryKeyStore(KeyTable& table) : table_(table) {}

    Result<void> insert(const Key& key) override {
        const std::lock_guard<std::mutex> lock(table_.mutex);
        if (table_.fault) return fail(*table_.fault);
        table_.keys.push_back(key);
        ++table_.changes;
        return {};
    }
    Result<std::vector<Key>> list() override {
        const std::lock_guard<std::mutex> lock(table_.mutex);
        if (table_.fault) return fail(*table_.fault);
        return table_.keys;
    }
    Result<Key> revoke(const std::string& id, UnixMs now) override {
        const std::lock_guard<std::mutex> lock(table_.mutex);
        if (table_.fault) return fail(*table_.fault);
        for (Key& key : table_.keys) {
            if (key.id != id || key.revoked) continue;
            key.revoked = now;
            ++table_.changes;
            return key;
        }
        return fail(ErrorCode::kNotFound, "no such key");
    }
    Result<std::int64_t> version() override {
        const std::lock_guard<std::mutex> lock(table_.mutex);
        if (table_.fault) return fail(*table_.fault);
        return table_.changes;
    }
    Result<std::map<std::string, KeyUsage>> usage() override {
        const std::lock_guard<std::mutex> lock(table_.mutex);
        if (table_.fault) return fail(*table_.fault);
        return table_.usage;
    }
    Result<void> saveUsage(const std::map<std::string, KeyUsage>& usage) override {
        const std::lock_guard<std::mutex> lock(table_.mutex);
        if (table_.fault) return fail(*table_.fault);
        for (const auto& [id, used] : usage) table_.usage[id] = used;
        return {};
    }

  private:
    KeyTable& table_;
};

/// Clocks that stand still until they are set.
struct TestClock {
    UnixMs wall = 1'800'000'000'000;
    std::chrono::milliseconds monotonic{1'000'000};

    Clock clock() {
        return {[this] { return wall; }, [this] { return monotonic; }};
    }
    void pass(std::chrono::milliseconds time) {
        wall += time.count();
        monotonic += time;
    }
};

}  // namespace shapedb::security
