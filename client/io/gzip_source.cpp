// SPDX-License-Identifier: Apache-2.0
#include "client/io/gzip_source.h"

#include <algorithm>
#include <new>
#include <utility>
#include <vector>

#include <zlib.h>

#include "client/io/unpacked_limit.h"
#include "core/base/return_if_error.h"

namespace shapedb::io {

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
