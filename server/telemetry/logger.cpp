// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/telemetry/logger.h"

#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <utility>

#include <nlohmann/json.hpp>
#include <spdlog/logger.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <sys/stat.h>

#include "common/api_key_text.h"
#include "common/safe_text.h"

namespace shapedb::telemetry {
namespace {

using Value = decltype(Field::value);

/// Longer than any reason of ours.
constexpr std::size_t kMaxFieldBytes = 2'048;

/// A JSON string literal without secrets; invalid UTF-8 becomes U+FFFD.
std::string jsonString(const std::string& text) {
    // A stranger must not fill the disk with one call. What is left of a secret that is cut is masked too.
    const std::string cut = maskSecrets(cutText(text, kMaxFieldBytes));
    // What JSON need not escape may still write on the terminal of whoever reads the log.
    return escapeUnsafe(nlohmann::json(cut).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

std::string number(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.6g", value);
    return buffer;
}

bool plainWord(const std::string& text) {
    if (text.empty()) return false;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte <= 0x20 || byte >= 0x7f || c == '"' || c == '=' || c == '\\') return false;
    }
    return true;
}

std::string show(const Value& value, bool json) {
    return std::visit(
        [json](const auto& v) -> std::string {
            using T = std::decay_t<decltype(v)>;
            if constexpr (std::is_same_v<T, std::string>) {
                return !json && v.size() <= kMaxFieldBytes && plainWord(v) ? maskSecrets(v) : jsonString(v);
            } else if constexpr (std::is_same_v<T, bool>) {
                return v ? "true" : "false";
            } else if constexpr (std::is_same_v<T, double>) {
                if (std::isfinite(v)) return number(v);
                return json ? "null" : number(v);  // JSON has no infinities
            } else {
                return std::to_string(v);
            }
        },
        value);
}

spdlog::level::level_enum spdlogLevel(Level level) {
    switch (level) {
        case Level::kTrace: return spdlog::level::trace;
        case Level::kDebug: return spdlog::level::debug;
        case Level::kInfo: return spdlog::level::info;
        case Level::kWarn: return spdlog::level::warn;
        case Level::kError: return spdlog::level::err;
    }
    return spdlog::level::err;
}

constexpr std::size_t kLevelWidth = 5;

std::string levelName(Level level) {
    switch (level) {
        case Level::kTrace: return "trace";
        case Level::kDebug: return "debug";
        case Level::kInfo: return "info";
        case Level::kWarn: return "warn";
        case Level::kError: return "error";
    }
    return "error";
}

class SpdlogLogger : public Logger {
  public:
    SpdlogLogger(
        spdlog::sink_ptr sink, const LogOptions& options, std::function<void()> onFailure = [] {})
        : json_(options.json), logger_("shapedb", std::move(sink)) {
        // UTC, so that lines of several machines sort.
        const char* pattern = json_ ? R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ",%v})" : "%Y-%m-%dT%H:%M:%S.%eZ %v";
        logger_.set_formatter(
            std::make_unique<spdlog::pattern_formatter>(pattern, spdlog::pattern_time_type::utc));
        logger_.set_level(spdlogLevel(options.level));
        logger_.flush_on(spdlog::level::trace);
        // A full disk must not make calls fail.
        logger_.set_error_handler([failed = std::move(onFailure)](const std::string&) { failed(); });
    }

    void log(Level level, const std::string& message, const std::vector<Field>& fields) override {
        const auto wanted = spdlogLevel(level);
        if (!logger_.should_log(wanted)) return;
        try {
            // The level by our names: spdlog calls "warn" "warning".
            std::string name = levelName(level);
            const std::string line =
                json_ ? "\"level\":\"" + name + "\"," + formatJson(message, fields)
                      : name.append(kLevelWidth - name.size(), ' ') + " " + formatText(message, fields);
            logger_.log(wanted, spdlog::string_view_t(line));
        } catch (const std::exception&) {
            // Out of memory for the line: it is lost, the call continues.
        }
    }

  private:
    bool json_;
    spdlog::logger logger_;
};

}  // namespace

std::vector<Field> fieldsOf(const Error& error) {
    return {{"error", std::string(errorCodeName(error.code))}, {"reason", error.message}};
}

Result<Level> levelFromName(const std::string& name) {
    if (name == "trace") return Level::kTrace;
    if (name == "debug") return Level::kDebug;
    if (name == "info") return Level::kInfo;
    if (name == "warn") return Level::kWarn;
    if (name == "error") return Level::kError;
    return fail(ErrorCode::kInvalidArgument,
                "unknown log level '" + name + "'; use trace, debug, info, warn or error");
}

std::string formatText(const std::string& message, const std::vector<Field>& fields) {
    std::string line;
    // A message may quote a client.
    const std::string safe = jsonString(message);
    line.append(safe, 1, safe.size() - 2);
    for (const Field& field : fields) line += " " + field.name + "=" + show(field.value, false);
    return line;
}

std::string formatJson(const std::string& message, const std::vector<Field>& fields) {
    std::string line = "\"message\":" + jsonString(message);
    for (const Field& field : fields) line += ",\"" + field.name + "\":" + show(field.value, true);
    return line;
}

Result<LoggerPtr> makeRotatingLog(const std::string& file, std::size_t bytes, std::size_t files,
                                  std::function<void()> onFailure) {
    struct stat status {};
    if (::lstat(file.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
        return fail(ErrorCode::kFileNotWritable, "log file " + file + " is a link or no file at all");
    }
    LogOptions options;
    options.json = true;
    options.file = file;
    try {
        spdlog::file_event_handlers handlers;
        handlers.after_open = [](const spdlog::filename_t& name, std::FILE*) {
            ::chmod(name.c_str(), S_IRUSR | S_IWUSR);
        };
        return std::make_shared<SpdlogLogger>(
            std::make_shared<spdlog::sinks::rotating_file_sink_mt>(file, bytes, files, false, handlers),
            options, std::move(onFailure));
    } catch (const std::exception& error) {
        return fail(ErrorCode::kFileNotWritable,
                    "log file " + file + " cannot be opened for writing: " + error.what());
    }
}

Result<LoggerPtr> makeLogger(const LogOptions& options) {
    try {
        spdlog::sink_ptr sink;
        if (options.file.empty()) {
            sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
        } else {
            sink = std::make_shared<spdlog::sinks::basic_file_sink_mt>(options.file);
        }
        return std::make_shared<SpdlogLogger>(std::move(sink), options);
    } catch (const std::exception& error) {
        return fail(ErrorCode::kFileNotWritable,
                    "log file " + options.file + " cannot be opened for writing: " + error.what());
    }
}

}  // namespace shapedb::telemetry
