// Where output goes: results to one stream, errors and progress to the other.
#pragma once

#include <chrono>
#include <iosfwd>
#include <mutex>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "core/base/error.h"

namespace shapedb::cli {

/// With --json the result stream gets exactly one JSON document, otherwise text for people. Errors and notes
/// go to the error stream as `PROGRAM: MESSAGE`.
///
/// Thread-safety: `note` and `progress` from any thread, the rest from one thread.
class Console {
  public:
    /// The streams must outlive the console. `errorIsTerminal`: draw a progress bar there.
    Console(std::ostream& out, std::ostream& err, bool errorIsTerminal, std::string program = "shapedb");

    void setJson(bool json) { json_ = json; }
    [[nodiscard]] bool json() const { return json_; }

    /// Text for people; dropped with --json.
    void text(const std::string& text);

    /// The one document of the command; dropped without --json.
    void document(const nlohmann::json& document);

    /// `PROGRAM: MESSAGE` on the error stream.
    void note(const std::string& message);

    /// The error that ends the command: a note, and with --json also the document {"error": {"name": ...,
    /// "message": ...}} unless a document was already printed.
    void failure(const Error& error);

    /// Redraws the progress bar, at most ten times a second and only if the error stream is a terminal.
    /// total 0: unknown, only the count is shown.
    void progress(const std::string& what, std::uint64_t done, std::uint64_t total);
    /// Erases the bar, so that other output starts on a clean line.
    void clearProgress();

    /// False if the result could not be written (a full disk, a closed pipe).
    [[nodiscard]] bool flush();

  private:
    void clearProgressLocked();

    std::ostream& out_;
    std::ostream& err_;
    const bool bar_;
    const std::string program_;
    bool json_ = false;
    bool documentPrinted_ = false;

    std::mutex mutex_;  ///< guards err_ and the members below
    bool barShown_ = false;
    std::chrono::steady_clock::time_point lastBar_{};
};

/// JSON text; bytes that are not UTF-8 become U+FFFD. Does not throw.
[[nodiscard]] std::string dump(const nlohmann::json& document);

/// {"name": ..., "message": ...}
[[nodiscard]] nlohmann::json toJson(const Error& error);

}  // namespace shapedb::cli
