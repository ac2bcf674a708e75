// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/telemetry/audit_log.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <ratio>
#include <string_view>
#include <utility>
#include <variant>

#include "common/safe_text.h"
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

constexpr std::size_t kMostFieldBytes = 200;
constexpr std::size_t kMostSummaryBytes = 1'000;
constexpr std::size_t kToldSources = 12;

/// The text of a field; empty if there is none.
std::string textOf(const std::vector<Field>& fields, std::string_view name) {
    for (const Field& field : fields) {
        const auto* text = std::get_if<std::string>(&field.value);
        if (field.name == name && text != nullptr) return *text;
    }
    return {};
}

/// Address without port, and the id of the key.
std::string sourceOf(const std::vector<Field>& call) {
    std::string source = textOf(call, "peer");
    source.erase(std::min(source.rfind(':'), source.size()));
    const std::string key = textOf(call, "caller");
    return key.empty() ? source : source + " key " + key;
}

}  // namespace

Result<std::unique_ptr<AuditLog>> AuditLog::open(const std::string& path, const LoggerPtr& log) {
    auto administration = openOne(path, log);
    RETURN_IF_ERROR(administration);
    auto refusals = openOne(refusalsBeside(path), log);
    RETURN_IF_ERROR(refusals);
    return std::make_unique<AuditLog>(std::move(*administration), std::move(*refusals));
}

AuditLog::AuditLog(LoggerPtr administration, LoggerPtr refusals)
    : administration_(std::move(administration)),
      refusals_(std::move(refusals)),
      refilled_(std::chrono::steady_clock::now()),
      everyMinute_(std::make_unique<RepeatingThread>(std::chrono::minutes(1), [this] { summarize(); })) {}

AuditLog::~AuditLog() {
    everyMinute_.reset();
    summarize();
}

void AuditLog::recordAdministration(const std::vector<Field>& call) {
    administration_->info("administration", call);
}

/// Under the lock.
bool AuditLog::mayWrite() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::ratio<60>> minutes = now - refilled_;
    refilled_ = now;
    lines_ = std::min<double>(kRefusalBurst, lines_ + kRefusalsPerMinute * minutes.count());
    if (lines_ < 1.0) return false;
    lines_ -= 1.0;
    return true;
}

void AuditLog::recordRefusal(std::vector<Field> call) {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (!mayWrite()) {
            ++leftOut_;
            const std::string source = sourceOf(call);
            const bool counted = ofSources_.size() < kCountedSources || ofSources_.count(source) > 0;
            if (counted) ++ofSources_[source];
            return;
        }
    }
    for (Field& field : call) {
        if (auto* text = std::get_if<std::string>(&field.value)) *text = cutText(*text, kMostFieldBytes);
    }
    refusals_->warn("refused", call);
}

void AuditLog::summarize() {
    std::uint64_t leftOut = 0;
    std::map<std::string, std::uint64_t> ofSources;
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        leftOut = std::exchange(leftOut_, 0);
        ofSources = std::exchange(ofSources_, {});
    }
    if (leftOut == 0) return;
    std::vector<std::pair<std::uint64_t, std::string>> most;
    for (const auto& [source, count] : ofSources) most.emplace_back(count, source);
    std::sort(most.rbegin(), most.rend());
    std::string told;
    std::uint64_t others = leftOut;
    for (std::size_t i = 0; i < std::min(most.size(), kToldSources); ++i) {
        told += (i == 0 ? "" : "; ") + most[i].second + ": " + std::to_string(most[i].first);
        others -= most[i].first;
    }
    if (others > 0) told += "; others: " + std::to_string(others);
    refusals_->warn("refusals that were only counted",
                    {{"left_out", leftOut}, {"of", cutText(told, kMostSummaryBytes)}});
}

}  // namespace shapedb::telemetry
