// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/console.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ostream>
#include <utility>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "client/cli/text.h"
#include "common/safe_text.h"

namespace shapedb::cli {

namespace {

constexpr auto kBarInterval = std::chrono::milliseconds(100);
constexpr int kBarWidth = 24;
/// Before this a pace says little.
constexpr double kPaceSeconds = 2.0;

std::string dumped(const nlohmann::json& document, int indent) {
    return escapeUnsafe(document.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace), true);
}

}  // namespace

TerminalOptions terminalAt(int descriptor) {
    const char* term = std::getenv("TERM");
    if (isatty(descriptor) == 0 || (term != nullptr && std::strcmp(term, "dumb") == 0)) return {};
    const char* plain = std::getenv("NO_COLOR");
    return {true, plain == nullptr || *plain == '\0'};
}

Console::Console(std::ostream& out, std::ostream& err, TerminalOptions terminal, std::string program)
    : out_(out), err_(err), terminal_(terminal), program_(std::move(program)) {}

void Console::write(const std::string& text) {
    errno = 0;
    // At once: a later error would not say what became of this.
    if (!(out_ << text << std::flush) && errno == EPIPE) readerLeft_ = true;
}

void Console::text(const std::string& text) { ownText(escapeUnsafe(text, true)); }

void Console::ownText(const std::string& text) {
    if (json()) return;
    clearProgress();
    write(text);
}

void Console::document(const nlohmann::json& document) {
    if (!json()) return;
    clearProgress();
    write((lines() ? dumpLine(document) : dump(document)) + '\n');
    documentPrinted_ = true;
}

void Console::item(const nlohmann::json& item) {
    if (!lines()) return;
    clearProgress();
    write(dumpLine(item) + '\n');
}

void Console::note(const std::string& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    clearProgressLocked();
    const std::string name = terminal_.colour ? "\x1b[1;31m" + program_ + ":\x1b[0m " : program_ + ": ";
    err_ << name << escapeUnsafe(wording_ ? wording_(message) : message) << '\n' << std::flush;
}

void Console::failure(const Error& error) {
    note(error.message);
    const Error told{error.code, wording_ ? wording_(error.message) : error.message};
    if (json() && !documentPrinted_) document({{"error", toJson(told)}});
}

std::string Console::pace(const std::string& what, std::uint64_t done, std::uint64_t total,
                          std::chrono::steady_clock::time_point now) {
    if (stage_ != what || done < doneAtBegin_) {
        stage_ = what;
        stageBegan_ = now;
        doneAtBegin_ = done;
    }
    const double seconds = std::chrono::duration<double>(now - stageBegan_).count();
    if (seconds < kPaceSeconds || done == doneAtBegin_) return {};
    const double rate = static_cast<double>(done - doneAtBegin_) / seconds;
    const std::string text = "  " + formatRate(rate);
    if (total <= done) return text;
    return text + ", " + formatSeconds(static_cast<double>(total - done) / rate) + " left";
}

void Console::progress(const std::string& what, std::uint64_t done, std::uint64_t total) {
    const std::lock_guard<std::mutex> lock(mutex_);
    lastWhat_ = what;
    lastDone_ = done;
    lastTotal_ = total;
    if (!terminal_.bar) return;
    const auto now = std::chrono::steady_clock::now();
    const std::string pace = this->pace(what, done, total, now);
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
    err_ << "\r\x1b[K" << text << pace << std::flush;
}

std::string Console::progressText() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (lastWhat_.empty()) return {};
    return lastWhat_ + ": " + formatCount(lastDone_) +
           (lastTotal_ > 0 ? " of " + formatCount(lastTotal_) : std::string());
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
    write({});
    return static_cast<bool>(out_);
}

std::string dump(const nlohmann::json& document) { return dumped(document, 2); }
std::string dumpLine(const nlohmann::json& document) { return dumped(document, -1); }

nlohmann::json toJson(const Error& error) {
    return {{"name", errorCodeName(error.code)}, {"message", error.message}};
}

ExitCode exitCodeOf(ErrorCode code) noexcept {
    switch (code) {
        case ErrorCode::kInvalidArgument:
        case ErrorCode::kMalformedFilter:
        case ErrorCode::kMalformedCursor: return kUsage;

        case ErrorCode::kNonFiniteCoordinate:
        case ErrorCode::kCoordinateOutOfRange:
        case ErrorCode::kTooFewPoints:
        case ErrorCode::kAllPointsEqual:
        case ErrorCode::kCollinear:
        case ErrorCode::kCoplanar:
        case ErrorCode::kNoInterior:
        case ErrorCode::kPointLimitExceeded:
        case ErrorCode::kFileNotReadable:
        case ErrorCode::kUnknownFileFormat:
        case ErrorCode::kMalformedFile:
        case ErrorCode::kFileNotWritable:
        case ErrorCode::kMalformedSignature:
        case ErrorCode::kMalformedStream:
        case ErrorCode::kChecksumMismatch:
        case ErrorCode::kCountMismatch: return kBadData;

        case ErrorCode::kNotFound:
        case ErrorCode::kAlreadyExists:
        case ErrorCode::kVersionConflict:
        case ErrorCode::kNotReady:
        case ErrorCode::kRejected:
        case ErrorCode::kUnauthenticated:
        case ErrorCode::kPermissionDenied: return kWrongState;

        case ErrorCode::kQueueFull:
        case ErrorCode::kRateLimited:
        case ErrorCode::kUnavailable:
        case ErrorCode::kDeadlineExceeded: return kUnavailable;

        case ErrorCode::kCancelled: return kInterrupted;

        case ErrorCode::kOutOfMemory:
        case ErrorCode::kStorage:
        case ErrorCode::kStorageFull:
        case ErrorCode::kDataLoss:
        case ErrorCode::kSchemaTooNew:
        case ErrorCode::kInternal: return kDefect;
    }
    return kDefect;
}

}  // namespace shapedb::cli
