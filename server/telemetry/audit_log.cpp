#include "server/telemetry/audit_log.h"

#include <utility>

namespace shapedb::telemetry {

Result<LoggerPtr> AuditLog::openFile(const std::string& path) {
    return makeRotatingLog(path, kAuditFileBytes, kAuditFiles);
}

void AuditLog::recordAdministration(const std::vector<Field>& call) { log_->info("administration", call); }

void AuditLog::recordRefusal(std::vector<Field> call) {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        const auto now = std::chrono::steady_clock::now();
        if (now - second_ >= std::chrono::seconds(1)) {
            second_ = now;
            inSecond_ = 0;
        }
        if (++inSecond_ > kRefusalsPerSecond) {
            ++leftOut_;
            return;
        }
        if (leftOut_ > 0) call.push_back({"left_out", std::exchange(leftOut_, 0)});
    }
    log_->warn("refused", call);
}

}  // namespace shapedb::telemetry
