// SPDX-License-Identifier: GPL-3.0-or-later
// Keeps scans that may have crashed the server apart from the others.
//
// When the process dies, every scan being segmented is a suspect. After the restart suspects are segmented
// one at a time: the guilty one dies alone, and the others are cleared instead of quarantined with
// it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>

#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::ingest {

/// Admits either any number of ordinary scans, or one suspect. A waiting suspect keeps new ordinary
/// scans out until it has had its turn. Thread-safe.
class CrashIsolation {
  public:
    /// Admission until destroyed. The constructor waits for it, which may take as long as another scan, or
    /// until `cancel` is set.
    class Pass {
      public:
        Pass(CrashIsolation& gate, bool suspect, const std::atomic<bool>& cancel);
        ~Pass();
        Pass(const Pass&) = delete;
        Pass& operator=(const Pass&) = delete;
        /// False when cancelled while it waited: the scan must not be segmented.
        [[nodiscard]] bool admitted() const { return admitted_; }

      private:
        CrashIsolation& gate_;
        const bool suspect_;
        bool admitted_;
    };

    /// Whether a Pass made now would have to wait.
    [[nodiscard]] bool wouldWait(bool suspect) const;
    /// How many wait for a Pass now.
    [[nodiscard]] int waiting() const;

  private:
    [[nodiscard]] bool isOpen(bool suspect) const;
    bool waitUntilOpen(std::unique_lock<std::mutex>& lock, bool suspect, const std::atomic<bool>& cancel);

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    int ordinary_ = 0;         ///< inside
    int waitingSuspects_ = 0;  ///< outside
    int waitingOrdinary_ = 0;  ///< outside
    bool suspectInside_ = false;
};

/// The log line of a quarantined scan, the same from workers and from rebuilds.
inline void logQuarantine(telemetry::Logger& log, const store::Shape& shape, const Error& why) {
    log.error("scan set aside: the server died each time it was segmented",
              {{"shape", shape.id}, {"key", shape.key}, {"reason", why.message}});
}

}  // namespace shapedb::ingest
