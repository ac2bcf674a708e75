// Which scans a rebuild had in hand when the process died, and how often.
//
// Ingest jobs count their attempts in the store; a rebuild has no jobs. Without this file, a
// scan that kills the server would do so again at every start, when the rebuild goes on.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::ingest {

/// A small text file, rewritten whole and renamed into place. It survives the death of the
/// process, which is all it is about; the machine's is nobody's fault. When it cannot be
/// written, that is logged and the rebuild goes on without. Thread-safe.
class CrashJournal {
  public:
    /// Reads what a dead process left. An empty path keeps everything in memory.
    CrashJournal(std::string path, telemetry::LoggerPtr log);

    /// Times the process died with these points in hand.
    [[nodiscard]] int deaths(const store::Shape& shape) const;

    /// In hand, until destroyed.
    class Entry {
      public:
        Entry(CrashJournal& journal, const store::Shape& shape);
        ~Entry();
        Entry(const Entry&) = delete;
        Entry& operator=(const Entry&) = delete;
        /// It came to an end, good or bad: no longer suspected.
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
        int deaths = 0;
        bool inHand = false;
    };

    void read();
    void write();

    std::string path_;
    telemetry::LoggerPtr log_;
    mutable std::mutex mutex_;
    std::map<std::pair<std::int64_t, std::int64_t>, State> states_;  ///< by shape id and points version
};

}  // namespace shapedb::ingest
