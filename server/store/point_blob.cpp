#include "server/store/point_blob.h"

#include <cstring>
#include <new>

#include <zstd.h>

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

tl::unexpected<Error> damaged(const std::string& how) {
    return fail(ErrorCode::kDataLoss, "the stored points are damaged: " + how);
}

Result<std::vector<float>> decodeRaw(const char* body, std::size_t size, std::uint64_t floatCount) {
    if (size / kFloatBytes != floatCount || size % kFloatBytes != 0) {
        return damaged(std::to_string(size) + " bytes for " + std::to_string(floatCount) + " numbers");
    }
    std::vector<float> points(static_cast<std::size_t>(floatCount));
    if (size > 0) std::memcpy(points.data(), body, size);
    return points;
}

Result<std::vector<float>> decodePlanes(const char* body, std::size_t size, std::uint64_t floatCount) {
    const unsigned long long content = ZSTD_getFrameContentSize(body, size);
    if (content == ZSTD_CONTENTSIZE_ERROR || content == ZSTD_CONTENTSIZE_UNKNOWN) {
        return damaged("no zstd frame of known size");
    }
    if (content / kFloatBytes != floatCount || content % kPointBytes != 0) {
        return damaged("a zstd frame of " + std::to_string(content) + " bytes for " +
                       std::to_string(floatCount) + " numbers");
    }
    std::vector<unsigned char> planes(static_cast<std::size_t>(content));
    const std::size_t got = ZSTD_decompress(planes.data(), planes.size(), body, size);
    if (ZSTD_isError(got) != 0) return damaged(ZSTD_getErrorName(got));
    if (got != planes.size()) return damaged("the zstd frame is shorter than it says");
    std::vector<float> points(static_cast<std::size_t>(floatCount));
    planesToBytes(planes.data(), reinterpret_cast<unsigned char*>(points.data()), points.size() / 3);
    return points;
}

}  // namespace

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
    return fail(ErrorCode::kOutOfMemory, "no memory to compress points");
}

Result<std::vector<float>> decodePoints(const void* blob, std::size_t size, std::uint64_t floatCount) try {
    if (size == 0) return damaged("empty");
    const char* bytes = static_cast<const char*>(blob);
    switch (static_cast<PointFormat>(bytes[0])) {
        case PointFormat::kRaw: return decodeRaw(bytes + 1, size - 1, floatCount);
        case PointFormat::kPlanesZstd: return decodePlanes(bytes + 1, size - 1, floatCount);
    }
    return fail(ErrorCode::kSchemaTooNew, "the stored points have format " +
                                              std::to_string(static_cast<unsigned char>(bytes[0])) +
                                              ", which this version does not know");
} catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "no memory for " + std::to_string(floatCount) + " coordinates");
}

}  // namespace shapedb::store
