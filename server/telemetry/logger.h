// SPDX-License-Identifier: GPL-3.0-or-later
// Log lines with named fields, as text for people or as JSON for machines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/base/error.h"

namespace shapedb::telemetry {

enum class Level { kTrace, kDebug, kInfo, kWarn, kError };

/// A named value. Names are lower_case and unique in a line; "time", "level" and "message" are
/// reserved.
struct Field {
    std::string name;
    std::variant<std::string, std::int64_t, std::uint64_t, double, bool> value;
};

/// Writes whole lines, never interleaved; texts are cut at 2 KiB. Values may hold any bytes: control
/// characters, quotes and invalid UTF-8 are escaped, so that no client can forge a line, and secrets of API
/// keys are masked (common/api_key_text.h), wherever a client put them. Thread-safe. There is no global
/// logger.
class Logger {
  public:
    virtual ~Logger() = default;
    virtual void log(Level level, const std::string& message, const std::vector<Field>& fields) = 0;

    void debug(const std::string& message, const std::vector<Field>& fields = {}) {
        log(Level::kDebug, message, fields);
    }
    void info(const std::string& message, const std::vector<Field>& fields = {}) {
        log(Level::kInfo, message, fields);
    }
    void warn(const std::string& message, const std::vector<Field>& fields = {}) {
        log(Level::kWarn, message, fields);
    }
    void error(const std::string& message, const std::vector<Field>& fields = {}) {
        log(Level::kError, message, fields);
    }
};

using LoggerPtr = std::shared_ptr<Logger>;

/// The fields of an error: error (its name) and reason (its message).
[[nodiscard]] std::vector<Field> fieldsOf(const Error& error);

struct LogOptions {
    Level level = Level::kInfo;
    bool json = false;
    std::string file;  ///< appended to; empty: standard error
};

/// "trace", "debug", "info", "warn", "error". Errors: kInvalidArgument.
[[nodiscard]] Result<Level> levelFromName(const std::string& name);

/// Errors: kFileNotWritable.
[[nodiscard]] Result<LoggerPtr> makeLogger(const LogOptions& options);

/// A log file that is replaced by the next one when it has `bytes`; `files` older ones are kept beside it as
/// NAME.1.EXT, NAME.2.EXT and so on. JSON, and only for its owner to read. `onFailure` is called, by whoever
/// logs, for lines that cannot be written. Errors: kFileNotWritable (also: it is a link).
[[nodiscard]] Result<LoggerPtr> makeRotatingLog(const std::string& file, std::size_t bytes, std::size_t files,
                                                std::function<void()> onFailure);

/// A line without time and level: `message name=value name="quoted value"`, or the members of a JSON
/// object without braces.
[[nodiscard]] std::string formatText(const std::string& message, const std::vector<Field>& fields);
[[nodiscard]] std::string formatJson(const std::string& message, const std::vector<Field>& fields);

}  // namespace shapedb::telemetry
