#include "client/io/input_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace shapedb::io {

namespace {

// Large enough that system calls and progress reports cost nothing compared with parsing.
constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

// Lines may be long (a triangle strip of a big model is one line); the limit only stops binary files from
// being read as a single line.
constexpr std::size_t kLongestLine = std::size_t{256} << 20;

Error notReadable(const std::string& path, const std::string& why) {
    return {ErrorCode::kFileNotReadable, path + ": cannot be read: " + why};
}

// std::strerror is not thread-safe.
std::string reason(int number) { return std::generic_category().message(number); }

}  // namespace

Result<InputFile> InputFile::open(const std::string& path, const RunContext& context) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return fail(notReadable(path, reason(errno)));
    InputFile file(path, descriptor, std::nullopt, context);
    struct stat status = {};
    if (::fstat(descriptor, &status) != 0) return fail(notReadable(path, reason(errno)));
    if (S_ISDIR(status.st_mode)) return fail(notReadable(path, "it is a folder; name a scan file"));
    if (S_ISREG(status.st_mode)) file.size_ = static_cast<std::uint64_t>(status.st_size);
    return file;
}

InputFile::InputFile(std::string path, int descriptor, std::optional<std::uint64_t> size,
                     const RunContext& context)
    : path_(std::move(path)), descriptor_(descriptor), size_(size), context_(&context) {}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      context_(other.context_),
      buffer_(std::move(other.buffer_)),
      begin_(other.begin_),
      end_(other.end_),
      bufferOffset_(other.bufferOffset_),
      lineNumber_(other.lineNumber_),
      failure_(std::move(other.failure_)) {}

InputFile::~InputFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

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
    ssize_t got = 0;
    do {
        got = ::read(descriptor_, buffer_.data() + end_, buffer_.size() - end_);
    } while (got < 0 && errno == EINTR);
    if (got < 0) failure_ = notReadable(path_, reason(errno));
    if (got <= 0) return false;
    end_ += static_cast<std::size_t>(got);
    context_->report("read", bufferOffset_ + end_, size_.value_or(0));
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
    do {
        for (; begin_ < end_; ++begin_) {
            if (buffer_[begin_] != '\0' && std::strchr(" \t\r\n", buffer_[begin_]) == nullptr) return false;
        }
    } while (readMore());
    return true;
}

void InputFile::skipByteOrderMark() {
    if (peek(3) == "\xEF\xBB\xBF") consume(3);
}

bool InputFile::readLine(std::string_view& line) {
    std::size_t searched = 0;
    const char* newline = nullptr;
    for (;;) {
        if (available() > searched) {
            newline = static_cast<const char*>(std::memchr(data() + searched, '\n', available() - searched));
        }
        if (newline != nullptr) break;
        searched = available();
        if (searched > kLongestLine) {
            ++lineNumber_;
            failure_ = malformedLine("no line end within 256 MiB; this is not a text file");
            return false;
        }
        if (!readMore()) break;
    }
    if (failure_ || (newline == nullptr && available() == 0)) return false;
    const std::size_t length = newline != nullptr ? static_cast<std::size_t>(newline - data()) : available();
    line = std::string_view(data(), length);
    begin_ += length + (newline != nullptr ? 1 : 0);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    ++lineNumber_;
    return true;
}

Error InputFile::malformedLine(const std::string& what) const {
    return malformed("line " + std::to_string(lineNumber_) + ": " + what);
}

Error InputFile::malformedByte(std::uint64_t offset, const std::string& what) const {
    return malformed("byte " + std::to_string(offset) + ": " + what);
}

Error InputFile::malformed(const std::string& what) const {
    return {ErrorCode::kMalformedFile, path_ + ": " + what};
}

}  // namespace shapedb::io
