// Who was refused, and what administrators did: one JSON object per line, in a file of its own.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "server/telemetry/logger.h"

namespace shapedb::telemetry {

/// Takes at most kAuditFiles + 1 files of kAuditFileBytes. Refused calls, of which a stranger can make any
/// number, are recorded up to kRefusalsPerSecond; the next one recorded tells how many were left out
/// (`left_out`), so that they push nothing else out of the files. Thread-safe.
class AuditLog {
  public:
    static constexpr std::size_t kAuditFileBytes = std::size_t{16} << 20;
    static constexpr std::size_t kAuditFiles = 10;
    static constexpr int kRefusalsPerSecond = 10;

    /// Errors: kFileNotWritable.
    [[nodiscard]] static Result<LoggerPtr> openFile(const std::string& path);
    explicit AuditLog(LoggerPtr log) : log_(std::move(log)) {}

    /// A call that administrators make, whatever came of it.
    void recordAdministration(const std::vector<Field>& call);
    /// A call that was refused for want of a key or of permission.
    void recordRefusal(std::vector<Field> call);

  private:
    const LoggerPtr log_;
    std::mutex mutex_;
    std::chrono::steady_clock::time_point second_;  ///< when the one being counted began
    int inSecond_ = 0;
    std::uint64_t leftOut_ = 0;
};

}  // namespace shapedb::telemetry
