// SPDX-License-Identifier: GPL-3.0-or-later
// Which scans a rebuild was segmenting when the process ended, how often, and how.
//
// Ingest jobs are counted in the store, but a rebuild has no jobs: without this file, a scan that crashes
// the server would do so again at every start.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/store/quarantine.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::ingest {

/// A small text file. It survives the death of the process, not a crash of the machine. If it cannot be
/// written, that is logged and the rebuild continues without it. Thread-safe.
class CrashJournal {
  public:
    /// Reads what a dead process left; `crashes` tells which scans were to blame. With an empty path
    /// everything stays in memory.
    CrashJournal(std::string path, const std::vector<store::Crash>& crashes, telemetry::LoggerPtr log);

    /// How often the process ended while these points were segmented.
    [[nodiscard]] store::Deaths deaths(const store::Shape& shape) const;

    /// The scan counts as being segmented until this is destroyed.
    class Entry {
      public:
        Entry(CrashJournal& journal, const store::Shape& shape);
        ~Entry();
        Entry(const Entry&) = delete;
        Entry& operator=(const Entry&) = delete;
        /// The scan was processed, well or badly: it is no suspect.
        void acquit() { acquitted_ = true; }

      private:
        CrashJournal& journal_;
        std::pair<std::int64_t, std::int64_t> key_;
        bool acquitted_ = false;
    };

    /// Forgets everything (the database was replaced).
    void clear();

  private:
    struct State {
        store::Deaths deaths;
        bool inHand = false;
    };

    void read(const std::vector<store::Crash>& crashes);
    void write();

    std::string path_;
    telemetry::LoggerPtr log_;
    mutable std::mutex mutex_;
    std::map<std::pair<std::int64_t, std::int64_t>, State> states_;  ///< by shape id and points version
};

}  // namespace shapedb::ingest
