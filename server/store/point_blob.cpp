// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/point_blob.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>

#include <zstd.h>

#include "core/base/return_if_error.h"
#include "server/store/failure.h"

namespace shapedb::store {

static_assert(sizeof(float) == 4, "points are stored as IEEE single precision");
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "points are stored little-endian");

namespace {

constexpr std::size_t kFloatBytes = sizeof(float);
constexpr std::size_t kPointBytes = 3 * kFloatBytes;

std::string rawBlob(const std::vector<float>& points) {
    std::string blob(1 + points.size() * kFloatBytes, static_cast<char>(PointFormat::kRaw));
    if (!points.empty()) std::memcpy(blob.data() + 1, points.data(), points.size() * kFloatBytes);
    return blob;
}

tl::unexpected<Error> damagedPoints(const std::string& how) {
    return fail(ErrorCode::kDataLoss, "the stored points are damagedPoints: " + how);
}

Result<std::vector<float>> decodeRaw(const char* body, std::size_t size, std::uint64_t floatCount) {
    if (size / kFloatBytes != floatCount || size % kFloatBytes != 0) {
        return damagedPoints(std::to_string(size) + " bytes for " + std::to_string(floatCount) + " numbers");
    }
    std::vector<float> points(static_cast<std::size_t>(floatCount));
    if (size > 0) std::memcpy(points.data(), body, size);
    return points;
}

Result<std::vector<float>> decodePlanes(const char* body, std::size_t size, std::uint64_t floatCount) {
    const unsigned long long content = ZSTD_getFrameContentSize(body, size);
    if (content == ZSTD_CONTENTSIZE_ERROR || content == ZSTD_CONTENTSIZE_UNKNOWN) {
        return damagedPoints("it is no zstd frame of known size");
    }
    if (content / kFloatBytes != floatCount || content % kPointBytes != 0) {
        return damagedPoints("a zstd frame of " + std::to_string(content) + " bytes for " +
                             std::to_string(floatCount) + " numbers");
    }
    std::vector<unsigned char> planes(static_cast<std::size_t>(content));
    const std::size_t got = ZSTD_decompress(planes.data(), planes.size(), body, size);
    if (ZSTD_isError(got) != 0) return damagedPoints(ZSTD_getErrorName(got));
    if (got != planes.size()) return damagedPoints("the zstd frame is shorter than it says");
    std::vector<float> points(static_cast<std::size_t>(floatCount));
    planesToBytes(planes.data(), reinterpret_cast<unsigned char*>(points.data()), points.size() / 3);
    return points;
}

}  // namespace

// Neighbouring points of a scan share sign, exponent and leading digits, so some planes hardly vary and
// compress well.
void bytesToPlanes(const unsigned char* in, unsigned char* out, std::size_t pointCount) {
    for (std::size_t k = 0; k < kPointBytes; ++k) {
        for (std::size_t i = 0; i < pointCount; ++i) out[k * pointCount + i] = in[kPointBytes * i + k];
    }
}

void planesToBytes(const unsigned char* in, unsigned char* out, std::size_t pointCount) {
    for (std::size_t k = 0; k < kPointBytes; ++k) {
        for (std::size_t i = 0; i < pointCount; ++i) out[kPointBytes * i + k] = in[k * pointCount + i];
    }
}

Result<std::string> encodePoints(const std::vector<float>& points, int level) try {
    if (points.empty()) return rawBlob(points);
    const std::size_t bytes = points.size() * kFloatBytes;
    std::vector<unsigned char> planes(bytes);
    bytesToPlanes(reinterpret_cast<const unsigned char*>(points.data()), planes.data(), points.size() / 3);
    std::string blob(1 + ZSTD_compressBound(bytes), static_cast<char>(PointFormat::kPlanesZstd));
    const std::size_t size = ZSTD_compress(blob.data() + 1, blob.size() - 1, planes.data(), bytes, level);
    if (ZSTD_isError(size) != 0) {
        return fail(ErrorCode::kInternal,
                    std::string("zstd cannot compress points: ") + ZSTD_getErrorName(size));
    }
    if (size >= bytes) return rawBlob(points);
    blob.resize(1 + size);
    return blob;
} catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "out of memory");  // fits without allocating
}

namespace {

/// Bytes of a plane handed to zstd at once.
constexpr std::size_t kPieceBytes = std::size_t{1} << 17;

struct FreeContext {
    void operator()(ZSTD_CCtx* context) const noexcept { ZSTD_freeCCtx(context); }
};
using Compressor = std::unique_ptr<ZSTD_CCtx, FreeContext>;

std::size_t orRaiseZstd(std::size_t zstdCode) {
    if (ZSTD_isError(zstdCode) == 0) return zstdCode;
    raise(ErrorCode::kInternal, std::string("zstd cannot compress points: ") + ZSTD_getErrorName(zstdCode));
}

/// One zstd frame of the planes one after another, in pieces; empty when it is not smaller than the
/// points. The planes are gathered piece by piece and never in memory as a whole.
std::vector<std::string> compressPlanes(const std::vector<float>& points, int level) {
    const Compressor context(ZSTD_createCCtx());
    if (!context) throw std::bad_alloc();
    const std::size_t count = points.size() / 3;
    orRaiseZstd(ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level));
    // Writes the size into the frame's header, where decodePlanes expects it.
    orRaiseZstd(ZSTD_CCtx_setPledgedSrcSize(context.get(), kPointBytes * count));
    const auto* bytes = reinterpret_cast<const unsigned char*>(points.data());
    std::vector<unsigned char> piece(kPieceBytes);
    std::vector<char> buffer(ZSTD_CStreamOutSize());
    std::vector<std::string> frame;
    std::size_t made = 0;
    for (std::size_t k = 0; k < kPointBytes; ++k) {
        for (std::size_t first = 0; first < count; first += kPieceBytes) {
            const std::size_t size = std::min(kPieceBytes, count - first);
            for (std::size_t i = 0; i < size; ++i) piece[i] = bytes[kPointBytes * (first + i) + k];
            const bool last = k + 1 == kPointBytes && first + size == count;
            ZSTD_inBuffer in{piece.data(), size, 0};
            for (bool more = true; more;) {
                ZSTD_outBuffer out{buffer.data(), buffer.size(), 0};
                const std::size_t left = orRaiseZstd(
                    ZSTD_compressStream2(context.get(), &out, &in, last ? ZSTD_e_end : ZSTD_e_continue));
                if (out.pos > 0) frame.emplace_back(buffer.data(), out.pos);
                made += out.pos;
                more = last ? left != 0 : in.pos < in.size;
            }
            // Not smaller: no need to go on.
            if (made >= kPointBytes * count) return {};
        }
    }
    return frame;
}

}  // namespace

Result<PointEncoding> PointEncoding::encode(const std::vector<float>& points, int level) {
    PointEncoding encoding;
    encoding.points_ = &points;
    const std::size_t bytes = points.size() * kFloatBytes;
    if (bytes <= kWholeBytes) {
        auto blob = encodePoints(points, level);
        RETURN_IF_ERROR(blob);
        encoding.blob_ = std::move(*blob);
        encoding.isWhole_ = true;
        encoding.size_ = encoding.blob_.size();
        return encoding;
    }
    return guarded("compress points", [&] {
        encoding.frame_ = compressPlanes(points, level);
        encoding.size_ = 1;
        for (const std::string& piece : encoding.frame_) encoding.size_ += piece.size();
        if (encoding.frame_.empty()) encoding.size_ += bytes;
        return std::move(encoding);
    });
}

void PointEncoding::write(const Sink& sink) const {
    if (isWhole_) return sink(blob_.data(), blob_.size());
    const auto format = static_cast<char>(frame_.empty() ? PointFormat::kRaw : PointFormat::kPlanesZstd);
    sink(&format, 1);
    if (frame_.empty()) return sink(points_->data(), points_->size() * kFloatBytes);
    for (const std::string& piece : frame_) sink(piece.data(), piece.size());
}

Result<std::vector<float>> decodePoints(const void* blob, std::size_t size, std::uint64_t floatCount) try {
    if (size == 0) return damagedPoints("empty");
    const char* bytes = static_cast<const char*>(blob);
    switch (static_cast<PointFormat>(bytes[0])) {
        case PointFormat::kRaw: return decodeRaw(bytes + 1, size - 1, floatCount);
        case PointFormat::kPlanesZstd: return decodePlanes(bytes + 1, size - 1, floatCount);
    }
    return fail(ErrorCode::kSchemaTooNew, "the stored points have format " +
                                              std::to_string(static_cast<unsigned char>(bytes[0])) +
                                              ", which this version does not know");
} catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory,
                "not enough memory for " + std::to_string(floatCount) + " coordinates");
}

}  // namespace shapedb::store
