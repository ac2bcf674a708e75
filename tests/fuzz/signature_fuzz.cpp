// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes what is stored of a shape and what SearchBySignature receives: any bytes are an error, or a value
// that encodes to the same bytes and scores within [0, 1]. The first byte chooses the format.
#include <cmath>

#include "core/fit/surface_points_codec.h"
#include "core/matching/score.h"
#include "core/signature/signature_codec.h"
#include "core/views/views_codec.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

namespace {

void trySignature(const std::string& bytes) {
    const auto decoded = decodeSignature(bytes);
    const Signature* signature = fuzz::valueOrExplained(decoded);
    if (signature == nullptr) return;
    require(!signature->points.empty() && signature->points.size() <= 16, "1 to 16 points");
    const std::string again = encodeSignature(*signature);
    const auto twice = decodeSignature(again);
    require(static_cast<bool>(twice), "what was encoded can be decoded");
    require(encodeSignature(*twice) == again, "encoding is stable");
    for (const bool partial : {false, true}) {
        ScoreOptions options;
        options.partial = partial;
        const auto scored = score(*signature, *signature, options);
        require(scored >= 0.0 && scored <= 1.0, "scores are in [0, 1]");
    }
}

template <typename Decode, typename Encode>
void tryCodec(const std::string& bytes, Decode decode, Encode encode) {
    const auto decoded = decode(bytes);
    if (fuzz::valueOrExplained(decoded) == nullptr) return;
    require(encode(*decoded) == bytes, "one value has one encoding");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    const int format = input.byte() % 3;
    const std::string bytes = input.rest();
    if (format == 0) trySignature(bytes);
    if (format == 1) tryCodec(bytes, decodeViews, encodeViews);
    if (format == 2) tryCodec(bytes, decodeSurfacePoints, encodeSurfacePoints);
    return 0;
}
