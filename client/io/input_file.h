// A file read front to back, through a buffer that grows only with the bytes that arrive. Private to
// client/io.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb::io {

/// After a device error, a cancellation or an absurdly long line the file appears to end; `failure` then has
/// the real reason, which readScan reports in place of the parser's error. Not thread-safe.
class InputFile {
  public:
    /// Errors: kFileNotReadable. `context` must outlive the file.
    static Result<InputFile> open(const std::string& path, const RunContext& context);

    InputFile(InputFile&& other) noexcept;
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;
    InputFile& operator=(InputFile&&) = delete;
    ~InputFile();

    const std::string& path() const { return path_; }
    const std::optional<Error>& failure() const { return failure_; }

    /// Byte position of data() in the file.
    std::uint64_t offset() const { return bufferOffset_ + begin_; }
    /// Bytes from offset() to the end of the file; unknown for a pipe.
    std::optional<std::uint64_t> remaining() const;
    /// False only if fewer than `bytes` are known to remain.
    bool mayHold(std::uint64_t bytes) const;

    /// The bytes in the buffer not yet consumed. Valid until the next call of a non-const member.
    const char* data() const { return buffer_.data() + begin_; }
    std::size_t available() const { return end_ - begin_; }

    /// Makes `bytes` available; false if the file ends before, with an unspecified number available.
    bool fill(std::uint64_t bytes) { return available() >= bytes || fillSlowly(bytes); }
    /// The first `bytes` of data(), fewer only if the file ends before.
    std::string_view peek(std::size_t bytes);
    /// `bytes` <= available().
    void consume(std::size_t bytes) { begin_ += bytes; }
    /// Skips bytes, also beyond the buffer; false if the file ends before.
    bool skip(std::uint64_t bytes);
    /// True if only white space and zero bytes are left (some writers pad). Consumes them.
    bool onlyPaddingLeft();
    /// Skips a UTF-8 byte order mark.
    void skipByteOrderMark();

    /// The next line without its \n or \r\n; false at the end of the file. The view is valid until the next
    /// call of a non-const member.
    bool readLine(std::string_view& line);
    /// Of the line last read, from 1.
    std::uint64_t lineNumber() const { return lineNumber_; }

    // "scan.ply: line 7: ..." / "scan.ply: byte 132: ..." with kMalformedFile.
    Error malformedLine(const std::string& what) const;
    Error malformedByte(std::uint64_t offset, const std::string& what) const;
    Error malformed(const std::string& what) const;

  private:
    InputFile(std::string path, int descriptor, std::optional<std::uint64_t> size, const RunContext& context);

    bool fillSlowly(std::uint64_t bytes);
    bool readMore();

    std::string path_;
    int descriptor_;
    std::optional<std::uint64_t> size_;
    const RunContext* context_;
    std::vector<char> buffer_;
    std::size_t begin_ = 0;
    std::size_t end_ = 0;
    std::uint64_t bufferOffset_ = 0;
    std::uint64_t lineNumber_ = 0;
    std::optional<Error> failure_;
};

}  // namespace shapedb::io
