#include "server/telemetry/audit_log.h"

#include <filesystem>
#include <optional>
#include <utility>

#include "core/base/return_if_error.h"

namespace shapedb::telemetry {

namespace {

/// Tells a log of lost lines, but not of each.
class LossReport {
  public:
    LossReport(LoggerPtr log, std::string path) : log_(std::move(log)), path_(std::move(path)) {}

    void tell() {
        const std::lock_guard<std::mutex> lock(mutex_);
        ++lost_;
        const auto now = std::chrono::steady_clock::now();
        if (told_ && now - *told_ < std::chrono::minutes(1)) return;
        told_ = now;
        log_->error("the audit log cannot be written: calls are missing in it",
                    {{"file", path_}, {"lost", std::exchange(lost_, 0)}});
    }

  private:
    const LoggerPtr log_;
    const std::string path_;
    std::mutex mutex_;
    std::optional<std::chrono::steady_clock::time_point> told_;
    std::uint64_t lost_ = 0;
};

Result<LoggerPtr> openOne(const std::string& path, const LoggerPtr& log) {
    const auto report = std::make_shared<LossReport>(log, path);
    return makeRotatingLog(path, AuditLog::kAuditFileBytes, AuditLog::kAuditFiles,
                           [report] { report->tell(); });
}

/// "audit.refused.log" of "audit.log".
std::string refusalsBeside(const std::string& path) {
    const std::filesystem::path whole(path);
    return (whole.parent_path() / (whole.stem().string() + ".refused" + whole.extension().string())).string();
}

}  // namespace

Result<std::unique_ptr<AuditLog>> AuditLog::open(const std::string& path, const LoggerPtr& log) {
    auto administration = openOne(path, log);
    RETURN_IF_ERROR(administration);
    auto refusals = openOne(refusalsBeside(path), log);
    RETURN_IF_ERROR(refusals);
    return std::make_unique<AuditLog>(std::move(*administration), std::move(*refusals));
}

void AuditLog::recordAdministration(const std::vector<Field>& call) {
    administration_->info("administration", call);
}

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
    refusals_->warn("refused", call);
}

}  // namespace shapedb::telemetry
