// SPDX-License-Identifier: Apache-2.0
#include "client/io/byte_source.h"

#include <algorithm>
#include <cerrno>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

#include <unistd.h>
#include <zlib.h>

#include "core/base/return_if_error.h"

namespace shapedb::io {

namespace {

class FileSource : public ByteSource {
  public:
    FileSource(std::string path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
    ~FileSource() override { ::close(descriptor_); }

    Result<std::size_t> read(char* to, std::size_t size) override {
        ssize_t got = 0;
        do {
            got = ::read(descriptor_, to, size);
        } while (got < 0 && errno == EINTR);
        if (got < 0) {
            // std::strerror is not thread-safe.
            return fail(ErrorCode::kFileNotReadable,
                        path_ + ": cannot be read: " + std::generic_category().message(errno));
        }
        position_ += static_cast<std::uint64_t>(got);
        return static_cast<std::size_t>(got);
    }
    std::uint64_t position() const override { return position_; }

  private:
    std::string path_;
    int descriptor_;
    std::uint64_t position_ = 0;
};

class PutBack : public ByteSource {
  public:
    PutBack(std::string bytes, std::unique_ptr<ByteSource> rest)
        : bytes_(std::move(bytes)), rest_(std::move(rest)) {}

    Result<std::size_t> read(char* to, std::size_t size) override {
        if (given_ == bytes_.size()) return rest_->read(to, size);
        const std::size_t given = bytes_.copy(to, size, given_);
        given_ += given;
        return given;
    }
    std::uint64_t position() const override { return rest_->position(); }

  private:
    std::string bytes_;
    std::size_t given_ = 0;
    std::unique_ptr<ByteSource> rest_;
};

constexpr std::uint32_t kReplacement = 0xfffd;

void appendUtf8(std::string& text, std::uint32_t c) {
    const auto put = [&](std::uint32_t byte) { text += static_cast<char>(byte); };
    const auto putRest = [&](int shift) { put(0x80U | ((c >> shift) & 0x3fU)); };
    if (c < 0x80) {
        put(c);
    } else if (c < 0x800) {
        put(0xc0U | (c >> 6));
        putRest(0);
    } else if (c < 0x10000) {
        put(0xe0U | (c >> 12));
        putRest(6);
        putRest(0);
    } else {
        put(0xf0U | (c >> 18));
        putRest(12);
        putRest(6);
        putRest(0);
    }
}

class Utf16Source : public ByteSource {
  public:
    Utf16Source(std::string path, std::unique_ptr<ByteSource> text, bool bigEndian)
        : path_(std::move(path)), text_(std::move(text)), bigEndian_(bigEndian), raw_(kRawBytes) {}

    Result<std::size_t> read(char* to, std::size_t size) override {
        while (given_ == utf8_.size() && !ended_) RETURN_IF_ERROR(convertMore());
        const std::size_t given = utf8_.copy(to, size, given_);
        given_ += given;
        return given;
    }
    std::uint64_t position() const override { return text_->position(); }

  private:
    static constexpr std::size_t kRawBytes = std::size_t{1} << 16;

    Result<void> convertMore() {
        utf8_.clear();
        given_ = 0;
        const auto got = text_->read(raw_.data() + kept_, raw_.size() - kept_);
        RETURN_IF_ERROR(got);
        const std::size_t bytes = kept_ + *got;
        ended_ = *got == 0;
        if (ended_ && kept_ > 0) {
            return fail(ErrorCode::kMalformedFile,
                        path_ + ": the file ends inside a character (UTF-16 text)");
        }
        for (std::size_t i = 0; i + 1 < bytes; i += 2) convert(unitAt(i));
        if (ended_ && high_ != 0) convert(0);  // its other half is missing
        kept_ = bytes % 2;
        if (kept_ > 0) raw_[0] = raw_[bytes - 1];
        return {};
    }

    std::uint32_t unitAt(std::size_t i) const {
        const auto first = static_cast<unsigned char>(raw_[i]);
        const auto second = static_cast<unsigned char>(raw_[i + 1]);
        return bigEndian_ ? first * 256U + second : second * 256U + first;
    }

    void convert(std::uint32_t unit) {
        const bool low = unit >= 0xdc00 && unit < 0xe000;
        if (high_ != 0) {
            const std::uint32_t high = std::exchange(high_, 0);
            if (low) return appendUtf8(utf8_, 0x10000 + ((high - 0xd800) << 10) + (unit - 0xdc00));
            appendUtf8(utf8_, kReplacement);
            if (ended_) return;
        }
        if (unit >= 0xd800 && unit < 0xdc00) {
            high_ = unit;
        } else {
            appendUtf8(utf8_, low ? kReplacement : unit);
        }
    }

    std::string path_;
    std::unique_ptr<ByteSource> text_;
    bool bigEndian_;
    bool ended_ = false;
    std::vector<char> raw_;
    std::size_t kept_ = 0;    // the first byte of raw_ is half a unit
    std::uint32_t high_ = 0;  // the first half of a surrogate pair
    std::string utf8_;
    std::size_t given_ = 0;
};

}  // namespace

std::unique_ptr<ByteSource> makeFileSource(std::string path, int descriptor) {
    return std::make_unique<FileSource>(std::move(path), descriptor);
}

std::unique_ptr<ByteSource> putBack(std::string bytes, std::unique_ptr<ByteSource> rest) {
    return std::make_unique<PutBack>(std::move(bytes), std::move(rest));
}

std::unique_ptr<ByteSource> makeUtf16Source(std::string path, std::unique_ptr<ByteSource> text,
                                            bool bigEndian) {
    return std::make_unique<Utf16Source>(std::move(path), std::move(text), bigEndian);
}

namespace {

// For inflateInit2: the largest window, with the header of gzip.
constexpr int kGzipWindow = 15 + 16;

class GzipSource : public ByteSource {
  public:
    GzipSource(std::string path, std::unique_ptr<ByteSource> packed)
        : path_(std::move(path)), packed_(std::move(packed)), input_(kInputBytes) {
        if (::inflateInit2(&stream_, kGzipWindow) != Z_OK) throw std::bad_alloc();
    }
    ~GzipSource() override { ::inflateEnd(&stream_); }

    Result<std::size_t> read(char* to, std::size_t size) override {
        size = std::min<std::size_t>(size, kMostAtOnce);
        stream_.next_out = reinterpret_cast<Bytef*>(to);
        stream_.avail_out = static_cast<uInt>(size);
        while (!ended_ && stream_.avail_out == size) {
            if (stream_.avail_in == 0) RETURN_IF_ERROR(readInput());
            if (betweenMembers_) {
                RETURN_IF_ERROR(beginMember());
            } else {
                RETURN_IF_ERROR(inflateSome());
            }
        }
        const std::size_t got = size - stream_.avail_out;
        unpacked_ += got;
        if (isBomb(unpacked_, packed_->position())) return fail(malformed(bombText()));
        return got;
    }
    std::uint64_t position() const override { return packed_->position(); }

  private:
    static constexpr std::size_t kInputBytes = std::size_t{1} << 16;
    static constexpr std::size_t kMostAtOnce = std::size_t{1} << 20;

    Result<void> readInput() {
        const auto got = packed_->read(input_.data(), input_.size());
        RETURN_IF_ERROR(got);
        stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
        stream_.avail_in = static_cast<uInt>(*got);
        if (*got > 0) return {};
        if (!betweenMembers_) return fail(malformed("the gzip data is cut short"));
        ended_ = true;
        return {};
    }

    // After a member comes the next one, the end, or zero bytes up to it.
    Result<void> beginMember() {
        while (stream_.avail_in > 0 && *stream_.next_in == 0) {
            ++stream_.next_in;
            --stream_.avail_in;
            padded_ = true;
        }
        if (stream_.avail_in == 0) return {};
        if (padded_ || *stream_.next_in != 0x1f) return fail(malformed("data after the gzip data"));
        ::inflateReset(&stream_);
        betweenMembers_ = false;
        return {};
    }

    Result<void> inflateSome() {
        switch (::inflate(&stream_, Z_NO_FLUSH)) {
            case Z_STREAM_END: betweenMembers_ = true; return {};
            case Z_OK:
            case Z_BUF_ERROR: return {};
            case Z_MEM_ERROR: throw std::bad_alloc();
            default: return fail(malformed("the gzip data is damaged"));
        }
    }

    Error malformed(const std::string& what) const {
        return {ErrorCode::kMalformedFile, path_ + ": " + what};
    }

    std::string path_;
    std::unique_ptr<ByteSource> packed_;
    std::vector<char> input_;
    z_stream stream_ = {};
    std::uint64_t unpacked_ = 0;
    bool betweenMembers_ = false;
    bool padded_ = false;
    bool ended_ = false;
};

}  // namespace

std::unique_ptr<ByteSource> makeGzipSource(std::string path, std::unique_ptr<ByteSource> packed) {
    return std::make_unique<GzipSource>(std::move(path), std::move(packed));
}

}  // namespace shapedb::io
