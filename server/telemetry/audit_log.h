// Who was refused, and what administrators did: one JSON object per line, in files of their own.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/telemetry/logger.h"

namespace shapedb::telemetry {

/// Refused calls, of which a stranger can make any number, have a file of their own, so that they push
/// nothing else out: for `audit.log` it is `audit.refused.log`. They are recorded up to kRefusalsPerSecond;
/// the next one recorded tells how many were left out (`left_out`). Each log takes at most kAuditFiles + 1
/// files of kAuditFileBytes. Thread-safe.
class AuditLog {
  public:
    static constexpr std::size_t kAuditFileBytes = std::size_t{16} << 20;
    static constexpr std::size_t kAuditFiles = 10;
    static constexpr int kRefusalsPerSecond = 10;

    /// Lines that cannot be written are told in `log`, once a minute. Errors: kFileNotWritable (also: a file
    /// is a link).
    [[nodiscard]] static Result<std::unique_ptr<AuditLog>> open(const std::string& path,
                                                                const LoggerPtr& log);
    AuditLog(LoggerPtr administration, LoggerPtr refusals)
        : administration_(std::move(administration)), refusals_(std::move(refusals)) {}

    /// A call that administrators make, whatever came of it.
    void recordAdministration(const std::vector<Field>& call);
    /// A call that was refused for want of a key or of permission.
    void recordRefusal(std::vector<Field> call);

  private:
    const LoggerPtr administration_;
    const LoggerPtr refusals_;
    std::mutex mutex_;
    std::chrono::steady_clock::time_point second_;  ///< when the one being counted began
    int inSecond_ = 0;
    std::uint64_t leftOut_ = 0;
};

}  // namespace shapedb::telemetry
