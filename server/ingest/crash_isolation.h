// Keeps scans that may have killed the server away from the others.
//
// When the process dies, every scan in hand is suspected. Segmented one at a time after the
// restart, the guilty one dies alone, and the others lose the suspicion instead of being set
// aside with it.
#pragma once

#include <condition_variable>
#include <mutex>

namespace shapedb::ingest {

/// Either any number of ordinary scans at once, or one suspect. A waiting suspect keeps new
/// ordinary scans out, so that it gets its turn. Thread-safe.
class CrashIsolation {
  public:
    /// Inside, until destroyed. The constructor waits.
    class Pass {
      public:
        Pass(CrashIsolation& gate, bool suspect);
        ~Pass();
        Pass(const Pass&) = delete;
        Pass& operator=(const Pass&) = delete;

      private:
        CrashIsolation& gate_;
        const bool suspect_;
    };

    /// Whether a Pass made now would have to wait.
    [[nodiscard]] bool wouldWait(bool suspect) const;

  private:
    [[nodiscard]] bool isOpen(bool suspect) const;

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    int ordinary_ = 0;         ///< inside
    int waitingSuspects_ = 0;  ///< outside
    bool suspectInside_ = false;
};

}  // namespace shapedb::ingest
