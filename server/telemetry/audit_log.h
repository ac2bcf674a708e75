// SPDX-License-Identifier: GPL-3.0-or-later
// Who was refused, and what administrators did: one JSON object per line, in files of their own.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/repeating_thread.h"
#include "core/base/error.h"
#include "server/telemetry/logger.h"

namespace shapedb::telemetry {

/// Refused calls, of which a stranger can make any number, have a file of their own, so that they push
/// nothing else out: for `audit.log` it is `audit.refused.log`. Nor do they push each other out in days:
/// kRefusalBurst are written one by one, and kRefusalsPerMinute more each minute; those beyond are counted
/// for each address and key, and once a minute one line tells how many there were (`left_out`) and of whom.
/// So a flood writes some 5 MB a day, and what was there before is kept for a month. Each log takes at most
/// kAuditFiles + 1 files of kAuditFileBytes. Thread-safe.
class AuditLog {
  public:
    static constexpr std::size_t kAuditFileBytes = std::size_t{16} << 20;
    static constexpr std::size_t kAuditFiles = 10;
    static constexpr int kRefusalBurst = 200;
    static constexpr int kRefusalsPerMinute = 2;
    /// Whose refusals are counted apart in one minute; the rest together.
    static constexpr std::size_t kCountedSources = 64;

    /// Lines that cannot be written are reported in `log`, once a minute. Errors: kFileNotWritable (also: a
    /// file is a link).
    [[nodiscard]] static Result<std::unique_ptr<AuditLog>> open(const std::string& path,
                                                                const LoggerPtr& log);
    AuditLog(LoggerPtr administration, LoggerPtr refusals);
    /// Writes what was only counted.
    ~AuditLog();

    /// A call that administrators make, whatever came of it.
    void recordAdministration(const std::vector<Field>& call);
    /// A call that was refused for want of a key or of permission. Its fields `peer` and `caller` tell whose
    /// it was; long ones are cut.
    void recordRefusal(std::vector<Field> call);
    /// Writes one line about those that were only counted, if there were any. Called once a minute.
    void summarize();

  private:
    bool mayWrite();

    const LoggerPtr administration_;
    const LoggerPtr refusals_;
    std::mutex mutex_;
    double lines_ = kRefusalBurst;                    ///< that may be written now
    std::chrono::steady_clock::time_point refilled_;  ///< lines_ is of that moment
    std::uint64_t leftOut_ = 0;                       ///< since the last summary
    std::map<std::string, std::uint64_t> ofSources_;  ///< of these, by address and key
    std::unique_ptr<RepeatingThread> everyMinute_;    ///< last: it uses the others
};

}  // namespace shapedb::telemetry
