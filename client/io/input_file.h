// SPDX-License-Identifier: Apache-2.0
// A file read front to back, through a buffer that grows only with the bytes that arrive. Private to
// client/io.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/io/byte_source.h"
#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb::io {

/// After a device error, a cancellation or an absurdly long line the file appears to end; `failure` then has
/// the real reason, which readScan reports in place of the parser's error. Not thread-safe.
class InputFile {
  public:
    /// `path` "-" is standard input. What gzip has packed is unpacked on the way (a kind that the file does
    /// not have to say by its name). Errors: kFileNotReadable. `context` must outlive the file.
    static Result<InputFile> open(const std::string& path, const RunContext& context);

    InputFile(InputFile&&) = default;
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;
    InputFile& operator=(InputFile&&) = delete;
    ~InputFile() = default;

    /// For messages; "standard input" for that.
    const std::string& path() const { return path_; }
    bool isStandardInput() const { return standardInput_; }
    const RunContext& context() const { return *context_; }
    const std::optional<Error>& failure() const { return failure_; }

    /// Byte position of data() in the file, unpacked and as UTF-8.
    std::uint64_t offset() const { return bufferOffset_ + begin_; }
    /// Bytes from offset() to the end of the file; unknown for a pipe, for packed data, and after decodeText
    /// found UTF-16.
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
    /// True if binary data ends here: with nothing left but zero bytes (some writers pad) and perhaps a line
    /// end or two (editors add them). Consumes them.
    bool onlyPaddingLeft();

    /// To be called at the start of a file of text. Skips a UTF-8 byte order mark; UTF-16, with a byte order
    /// mark or without, is read as UTF-8 from now on.
    void decodeText();
    /// Whether decodeText found UTF-16: nothing binary can follow.
    bool isRecoded() const { return recoded_; }

    /// The next line without its end: LF, CR LF, or CR alone. False at the end of the file; a last line of
    /// nothing but zero bytes or Ctrl-Z is none. The view is valid until the next call of a non-const member.
    bool readLine(std::string_view& line);
    /// The number of the line last read, from 1.
    std::uint64_t lineNumber() const { return lineNumber_; }
    /// To be called after the last line before binary data. Of lines that end in CR alone, a line feed after
    /// the last is data.
    void beginBinary();
    /// Lines from here on that are not blank; unknown if the file goes on beyond 1 MiB.
    std::optional<std::uint64_t> contentLinesLeft();

    // "scan.ply: line 7: ..." / "scan.ply: byte 132: ..." with kMalformedFile. Before the first line:
    // "scan.ply: the file is empty".
    Error malformedLine(const std::string& what) const;
    Error malformedByte(std::uint64_t offset, const std::string& what) const;
    Error malformed(const std::string& what) const;

  private:
    enum class LineEnd { kNone, kLf, kCrLf, kCr };

    InputFile(std::string path, std::unique_ptr<ByteSource> source, std::optional<std::uint64_t> size,
              const RunContext& context);

    bool fillSlowly(std::uint64_t bytes);
    bool readMore();
    std::size_t lengthOfLine();
    LineEnd lineEndAt(std::size_t position);
    std::unique_ptr<ByteSource> takeSource();

    std::string path_;
    std::unique_ptr<ByteSource> source_;
    std::optional<std::uint64_t> size_;      // of what the source gives
    std::optional<std::uint64_t> fileSize_;  // on the disk
    std::uint64_t reported_ = 0;             // progress
    const RunContext* context_;
    std::vector<char> buffer_;
    std::size_t begin_ = 0;
    std::size_t end_ = 0;
    std::uint64_t bufferOffset_ = 0;
    std::uint64_t lineNumber_ = 0;
    LineEnd lineEnd_ = LineEnd::kNone;  // of the line last read
    LineEnd lineEndBefore_ = LineEnd::kNone;
    bool recoded_ = false;
    bool standardInput_ = false;
    std::optional<Error> failure_;
};

}  // namespace shapedb::io
