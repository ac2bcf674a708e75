// SPDX-License-Identifier: GPL-3.0-or-later
// Fixed workloads of a store, one call to the store in each step.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/store/sqlite/sqlite_store.h"

namespace shapedb::reliability {

/// What later steps need of earlier ones. Changed only by steps that succeed.
struct Memory {
    std::int64_t collectionId = 0;
    std::int64_t rebuildId = 0;
    std::vector<store::Job> claimed;
    std::string lastBackup;  ///< its name in the folder
};

/// While one lives, the program is inside a call of the store.
class InStore {
  public:
    InStore() { inside_ = true; }
    ~InStore() { inside_ = false; }
    InStore(const InStore&) = delete;
    InStore& operator=(const InStore&) = delete;
    static bool now() { return inside_; }

  private:
    static inline bool inside_ = false;
};

/// A store in a folder of its own.
struct World {
    explicit World(std::string where) : folder(std::move(where)) {}

    [[nodiscard]] std::string path() const { return folder + "/shapes.db"; }
    /// Opens the store, anew if it is open.
    Result<void> open();

    std::string folder;
    std::int64_t clock = 1000;  ///< what the store takes for the time
    Memory memory;
    std::unique_ptr<store::Store> store;
};

struct Step {
    std::string name;
    std::function<Result<void>(World&)> run;
    /// Changes nothing that is stored.
    bool reads = false;
};

/// Every call of a store, with one collection of a few shapes; `round` makes the names and points differ, so
/// that rounds can follow each other.
[[nodiscard]] std::vector<Step> storeScript(int round);

}  // namespace shapedb::reliability
