#include "client/cli/console.h"

#include <ostream>
#include <utility>

#include <nlohmann/json.hpp>

#include "client/cli/text.h"
#include "common/safe_text.h"

namespace shapedb::cli {

namespace {

constexpr auto kBarInterval = std::chrono::milliseconds(100);
constexpr int kBarWidth = 24;

}  // namespace

Console::Console(std::ostream& out, std::ostream& err, bool errorIsTerminal, std::string program)
    : out_(out), err_(err), bar_(errorIsTerminal), program_(std::move(program)) {}

void Console::text(const std::string& text) {
    if (json_) return;
    clearProgress();
    out_ << escapeUnsafe(text, true);
}

void Console::document(const nlohmann::json& document) {
    if (!json_) return;
    clearProgress();
    out_ << dump(document) << '\n';
    documentPrinted_ = true;
}

void Console::note(const std::string& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    clearProgressLocked();
    err_ << program_ << ": " << escapeUnsafe(message, true) << '\n' << std::flush;
}

void Console::failure(const Error& error) {
    note(error.message);
    if (json_ && !documentPrinted_) document({{"error", toJson(error)}});
}

void Console::progress(const std::string& what, std::uint64_t done, std::uint64_t total) {
    if (!bar_) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (barShown_ && now - lastBar_ < kBarInterval) return;
    lastBar_ = now;
    barShown_ = true;
    std::string text = escapeUnsafe(what) + "  ";
    if (total > 0) {
        const double share = static_cast<double>(done) / static_cast<double>(total);
        text += bar(share, kBarWidth) + "  " + formatCount(done) + " / " + formatCount(total);
    } else {
        text += formatCount(done);
    }
    err_ << "\r\x1b[K" << text << std::flush;
}

void Console::clearProgress() {
    const std::lock_guard<std::mutex> lock(mutex_);
    clearProgressLocked();
}

void Console::clearProgressLocked() {
    if (!barShown_) return;
    err_ << "\r\x1b[K" << std::flush;
    barShown_ = false;
}

bool Console::flush() {
    clearProgress();
    out_.flush();
    return static_cast<bool>(out_);
}

std::string dump(const nlohmann::json& document) {
    return escapeUnsafe(document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace), true);
}

nlohmann::json toJson(const Error& error) {
    return {{"name", errorCodeName(error.code)}, {"message", error.message}};
}

}  // namespace shapedb::cli
