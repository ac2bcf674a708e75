// SPDX-License-Identifier: Apache-2.0
#include "client/io/input_file.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "client/io/byte_source.h"
#include "client/io/text.h"

namespace shapedb::io {

namespace {

// Large enough that system calls and progress reports cost nothing compared with parsing.
constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

// Lines may be long (a triangle strip of a big model is one line); the limit only stops binary files from
// being read as a single line.
constexpr std::size_t kLongestLine = std::size_t{256} << 20;

// What may fill up the end of a text file: zero bytes, and the Ctrl-Z of old systems.
constexpr std::string_view kFileEnds("\0\x1a \t", 4);

// More of them may be points: a point of three floats has twelve bytes.
constexpr int kMostBlanksOfPadding = 4;

Error notReadable(const std::string& path, const std::string& why) {
    return {ErrorCode::kFileNotReadable, path + ": cannot be read: " + why};
}

// std::strerror is not thread-safe.
std::string reason(int number) { return std::generic_category().message(number); }

}  // namespace

Result<InputFile> InputFile::open(const std::string& path, const RunContext& context) {
    const bool standardInput = path == "-";
    const std::string name = standardInput ? "standard input" : path;
    const int descriptor = standardInput ? ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0)
                                         : ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return fail(notReadable(name, reason(errno)));
    InputFile file(name, makeFileSource(name, descriptor), std::nullopt, context);
    file.standardInput_ = standardInput;
    struct stat status = {};
    if (::fstat(descriptor, &status) != 0) return fail(notReadable(name, reason(errno)));
    if (S_ISDIR(status.st_mode)) return fail(notReadable(name, "it is a folder; name a scan file"));
    if (S_ISREG(status.st_mode) && !standardInput) {
        file.size_ = file.fileSize_ = static_cast<std::uint64_t>(status.st_size);
    }
    if (file.peek(3) == "\x1f\x8b\x08") file.source_ = makeGzipSource(name, file.takeSource());
    return file;
}

InputFile::InputFile(std::string path, std::unique_ptr<ByteSource> source, std::optional<std::uint64_t> size,
                     const RunContext& context)
    : path_(std::move(path)), source_(std::move(source)), size_(size), fileSize_(size), context_(&context) {}

std::optional<std::uint64_t> InputFile::remaining() const {
    if (!size_) return std::nullopt;
    return *size_ > offset() ? *size_ - offset() : 0;
}

bool InputFile::mayHold(std::uint64_t bytes) const {
    const auto left = remaining();
    return !left || bytes <= *left;
}

bool InputFile::readMore() {
    if (failure_) return false;
    if (const auto go = context_->checkpoint(); !go) {
        failure_ = go.error();
        return false;
    }
    if (begin_ > 0) {
        std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
                  buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
        bufferOffset_ += begin_;
        end_ -= begin_;
        begin_ = 0;
    }
    if (end_ == buffer_.size()) buffer_.resize(std::max(kBufferBytes, 2 * buffer_.size()));
    const auto got = source_->read(buffer_.data() + end_, buffer_.size() - end_);
    if (!got) failure_ = got.error();
    if (!got || *got == 0) return false;
    end_ += *got;
    if (source_->position() > reported_) {
        reported_ = source_->position();
        context_->report("read", reported_, fileSize_.value_or(0));
    }
    return true;
}

bool InputFile::fillSlowly(std::uint64_t bytes) {
    if (!mayHold(bytes)) return false;
    while (available() < bytes) {
        if (!readMore()) return false;
    }
    return true;
}

std::string_view InputFile::peek(std::size_t bytes) {
    while (available() < bytes && readMore()) {
    }
    return {data(), std::min(bytes, available())};
}

bool InputFile::skip(std::uint64_t bytes) {
    if (!mayHold(bytes)) return false;
    while (bytes > available()) {
        bytes -= available();
        begin_ = end_;
        if (!readMore()) return false;
    }
    begin_ += static_cast<std::size_t>(bytes);
    return true;
}

bool InputFile::onlyPaddingLeft() {
    int blanks = 0;
    do {
        for (; begin_ < end_; ++begin_) {
            if (buffer_[begin_] == '\0') continue;
            const bool blank = isBlank(buffer_[begin_]) || buffer_[begin_] == '\n';
            if (!blank || ++blanks > kMostBlanksOfPadding) return false;
        }
    } while (readMore());
    return true;
}

// All that has not been consumed, for a source that reads it in another way.
std::unique_ptr<ByteSource> InputFile::takeSource() {
    auto source = putBack(std::string(data(), available()), std::move(source_));
    begin_ = end_ = 0;
    bufferOffset_ = 0;
    size_ = std::nullopt;
    return source;
}

void InputFile::decodeText() {
    const std::string_view start = peek(4);
    if (start.substr(0, 3) == "\xEF\xBB\xBF") return consume(3);
    const bool little = start.substr(0, 2) == "\xFF\xFE";
    const bool big = start.substr(0, 2) == "\xFE\xFF";
    if (start == std::string_view("\xFF\xFE\0\0", 4) || start == std::string_view("\0\0\xFE\xFF", 4)) {
        failure_ = malformed("UTF-32 text is not read; save the file as UTF-8");
        return consume(available());
    }
    // Without a byte order mark every second byte of the first letters is zero.
    const auto lettersAt = [&](std::size_t first) {
        const auto isLetter = [](char c) { return c >= '\t' && c <= '~'; };
        return start.size() == 4 && isLetter(start[first]) && isLetter(start[first + 2]) &&
               start[1 - first] == '\0' && start[3 - first] == '\0';
    };
    if (little || big) consume(2);
    if (!little && !big && !lettersAt(0) && !lettersAt(1)) return;
    recoded_ = true;
    const bool bigEndian = big || lettersAt(1);
    source_ = makeUtf16Source(path_, takeSource(), bigEndian);
}

/// Bytes before the next line end, or all that are left of the file.
std::size_t InputFile::lengthOfLine() {
    std::size_t length = 0;
    for (;;) {
        // Digits, letters and blanks are all greater than the two that are looked for.
        while (length < available() &&
               (data()[length] > '\r' || (data()[length] != '\n' && data()[length] != '\r'))) {
            ++length;
        }
        if (length < available()) return length;
        if (length > kLongestLine) {
            ++lineNumber_;
            failure_ = malformedLine("no line end within 256 MiB; this is not a text file");
            return length;
        }
        if (!readMore()) return length;
    }
}

InputFile::LineEnd InputFile::lineEndAt(std::size_t position) {
    if (position == available()) return LineEnd::kNone;
    if (data()[position] == '\n') return LineEnd::kLf;
    return fill(position + 2) && data()[position + 1] == '\n' ? LineEnd::kCrLf : LineEnd::kCr;
}

bool InputFile::readLine(std::string_view& line) {
    const std::size_t length = lengthOfLine();
    if (failure_) return false;
    const LineEnd end = lineEndAt(length);
    line = std::string_view(data(), length);
    if (end == LineEnd::kNone && line.find_first_not_of(kFileEnds) == std::string_view::npos) {
        consume(length);
        return false;
    }
    consume(length + (end == LineEnd::kNone ? 0 : end == LineEnd::kCrLf ? 2 : 1));
    lineEndBefore_ = std::exchange(lineEnd_, end);
    ++lineNumber_;
    return true;
}

void InputFile::beginBinary() {
    // Still in the buffer: the line was read just now.
    if (lineEnd_ == LineEnd::kCrLf && lineEndBefore_ == LineEnd::kCr) --begin_;
}

std::optional<std::uint64_t> InputFile::contentLinesLeft() {
    std::string_view text = peek(kBufferBytes);
    if (text.size() == kBufferBytes) return std::nullopt;
    std::uint64_t lines = 0;
    bool blank = true;
    for (const char c : text) {
        if (c == '\n' || c == '\r') {
            blank = true;
        } else if (blank && !isBlank(c)) {
            blank = false;
            ++lines;
        }
    }
    return lines;
}

Error InputFile::malformedLine(const std::string& what) const {
    if (lineNumber_ == 0) return malformed("the file is empty");
    return malformed("line " + std::to_string(lineNumber_) + ": " + what);
}

Error InputFile::malformedByte(std::uint64_t offset, const std::string& what) const {
    return malformed("byte " + std::to_string(offset) + ": " + what);
}

Error InputFile::malformed(const std::string& what) const {
    return {ErrorCode::kMalformedFile, path_ + ": " + what};
}

}  // namespace shapedb::io
