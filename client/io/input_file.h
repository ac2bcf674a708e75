// A file read front to back through a buffer that grows only with bytes that really arrive.
// Private to client/io.
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

/// Not thread-safe. A device error, a cancelled context or an absurdly long line makes the file
/// look as if it ended there; `failure` then holds the real reason, and readScan reports it
/// instead of what the parser made of the early end.
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
    /// Bytes from offset() to the end of the file; nothing for a pipe.
    std::optional<std::uint64_t> remaining() const;
    /// False only if it is certain that fewer than `bytes` remain.
    bool mayHold(std::uint64_t bytes) const;

    /// The bytes in the buffer that have not been consumed. Valid until the next call of a
    /// non-const member.
    const char* data() const { return buffer_.data() + begin_; }
    std::size_t available() const { return end_ - begin_; }

    /// Makes `bytes` available; false if the file ends before (what is available then is open).
    bool fill(std::uint64_t bytes) { return available() >= bytes || fillSlowly(bytes); }
    /// The first at most `bytes` of data(), fewer only where the file ends before.
    std::string_view peek(std::size_t bytes);
    /// `bytes` <= available().
    void consume(std::size_t bytes) { begin_ += bytes; }
    /// Passes over bytes that need not be in the buffer; false if the file ends before.
    bool skip(std::uint64_t bytes);
    /// True if only white space and zero bytes are left: padding some writers add. Consumes it.
    bool onlyPaddingLeft();
    /// Passes over the UTF-8 mark some editors put in front of a text file.
    void skipByteOrderMark();

    /// The next line without its \n or \r\n; false at the end of the file. The view is valid
    /// until the next call of a non-const member.
    bool readLine(std::string_view& line);
    /// Number of the line last read, from 1.
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
