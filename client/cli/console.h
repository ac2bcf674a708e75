// SPDX-License-Identifier: GPL-3.0-or-later
// Where output goes: results to one stream, errors and progress to the other.
#pragma once

#include <chrono>
#include <functional>
#include <iosfwd>
#include <mutex>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "core/base/error.h"

namespace shapedb::cli {

/// What a terminal at the error stream is given.
struct TerminalOptions {
    bool bar = false;     ///< a progress bar
    bool colour = false;  ///< the program's name in red where an error is reported
};

/// The terminal at file descriptor `descriptor`: nothing if it is none or TERM is "dumb", no colour with
/// NO_COLOR (https://no-color.org).
[[nodiscard]] TerminalOptions terminalAt(int descriptor);

/// With --json the result stream gets exactly one JSON document, with --json-lines one line of JSON for each
/// item, otherwise text for people. Errors and notes go to the error stream as `PROGRAM: MESSAGE`.
///
/// Thread-safety: `note` and `progress` from any thread, the rest from one thread.
class Console {
  public:
    enum class Form { kText, kJson, kJsonLines };

    /// The streams must outlive the console.
    Console(std::ostream& out, std::ostream& err, TerminalOptions terminal, std::string program = "shapedb");

    void setForm(Form form) { form_ = form; }
    void setJson(bool json) { form_ = json ? Form::kJson : Form::kText; }
    /// --json or --json-lines.
    [[nodiscard]] bool json() const { return form_ != Form::kText; }
    /// --json-lines: a command with many items gives each to `item` as it comes, and no document.
    [[nodiscard]] bool lines() const { return form_ == Form::kJsonLines; }

    /// Applied to every message on the error stream.
    void setWording(std::function<std::string(const std::string&)> wording) { wording_ = std::move(wording); }

    /// Text for people; dropped with --json.
    void text(const std::string& text);

    /// The same for text of the program itself, tabs and all: nothing in it is escaped.
    void ownText(const std::string& text);

    /// The one document of the command; dropped without --json. With --json-lines it is on one line.
    void document(const nlohmann::json& document);

    /// One line; dropped without --json-lines.
    void item(const nlohmann::json& item);

    /// `PROGRAM: MESSAGE` on the error stream: one line, whatever is in it.
    void note(const std::string& message);

    /// The error that ends the command: a note, and with --json also the document {"error": {"name": ...,
    /// "message": ...}} unless a document was already printed.
    void failure(const Error& error);

    /// Redraws the progress bar, at most ten times a second and only if the error stream is a terminal: how
    /// much is done, and after two seconds of one `what` how fast it goes and how long it will take. total 0:
    /// unknown, only the count is shown.
    void progress(const std::string& what, std::uint64_t done, std::uint64_t total);
    /// What `progress` was told last, whether it was shown or not: "compare: 12 of 340"; empty if nothing.
    [[nodiscard]] std::string progressText();
    /// Erases the bar, so that other output starts on a clean line.
    void clearProgress();

    /// False if the result could not be written (a full disk, a closed pipe).
    [[nodiscard]] bool flush();
    /// Who read the result has closed the pipe, as `head` does: the rest is not wanted.
    [[nodiscard]] bool readerLeft() const { return readerLeft_; }

  private:
    void write(const std::string& text);
    void clearProgressLocked();
    std::string pace(const std::string& what, std::uint64_t done, std::uint64_t total,
                     std::chrono::steady_clock::time_point now);

    std::ostream& out_;
    std::ostream& err_;
    const TerminalOptions terminal_;
    const std::string program_;
    std::function<std::string(const std::string&)> wording_;
    Form form_ = Form::kText;
    bool documentPrinted_ = false;
    bool readerLeft_ = false;

    std::mutex mutex_;      ///< guards err_ and the members below
    std::string lastWhat_;  ///< that and its numbers as `progress` was told them last
    std::uint64_t lastDone_ = 0;
    std::uint64_t lastTotal_ = 0;
    bool barShown_ = false;
    std::chrono::steady_clock::time_point lastBar_{};
    std::string stage_;  ///< what the bar shows, since when, and how much was done then
    std::chrono::steady_clock::time_point stageBegan_{};
    std::uint64_t doneAtBegin_ = 0;
};

/// JSON text; bytes that are not UTF-8 become U+FFFD. Does not throw.
[[nodiscard]] std::string dump(const nlohmann::json& document);
/// The same on one line.
[[nodiscard]] std::string dumpLine(const nlohmann::json& document);

/// {"name": ..., "message": ...}
[[nodiscard]] nlohmann::json toJson(const Error& error);

// Exit codes; docs/command-line.md lists them with the error names.

enum ExitCode : int {
    kOk = 0,
    kSomeFailed = 1,    ///< some of several items failed
    kUsage = 2,         ///< wrong command line, parameter, filter or cursor
    kBadData = 3,       ///< a file that cannot be read or written, or a scan that cannot be used
    kWrongState = 4,    ///< not found, already there, or not allowed now
    kUnavailable = 5,   ///< the server cannot be reached, is full, or took too long
    kDefect = 6,        ///< storage, memory or a bug: not the caller's fault
    kInterrupted = 130  ///< Ctrl-C (128 + SIGINT, as in shells)
};

/// For a command that ended with this error.
[[nodiscard]] ExitCode exitCodeOf(ErrorCode code) noexcept;

}  // namespace shapedb::cli
