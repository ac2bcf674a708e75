// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the whole road from points to a signature, on tiny clouds: an error, or a signature that can be
// stored and is alike to itself. Coordinates are small integers, so that points repeat and lie on lines and
// planes, or any floats.
#include <cmath>

#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

namespace {

constexpr std::size_t kMostPoints = 64;

PointCloud cloudFrom(fuzz::Input& input) {
    PointCloud points;
    const bool integers = input.byte() % 4 != 0;
    const double step = integers ? std::ldexp(1.0, input.byte() % 32 - 16) : 0.0;
    while (input.left() >= 3 && points.size() < kMostPoints) {
        const auto coordinate = [&]() -> double {
            return integers ? step * static_cast<std::int8_t>(input.byte())
                            : static_cast<double>(input.number<float>());
        };
        const double x = coordinate(), y = coordinate(), z = coordinate();
        points.push_back({x, y, z});
    }
    return points;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    ShapeParameters parameters = parametersOf(input.byte() % 2 == 0 ? Profile::kDefault : Profile::kPaper);
    parameters.segmentation.preparation.decimateTo =
        input.byte() % 4 == 0 ? 16 : parameters.segmentation.preparation.decimateTo;
    const PointCloud points = cloudFrom(input);
    const auto described = describe(points, parameters, {});
    if (fuzz::valueOrExplained(described) == nullptr) return 0;
    require(described->segmentation.pointSegment.size() == points.size(), "each point has a label");
    const Signature& signature = described->signature;
    const auto decoded = decodeSignature(encodeSignature(signature));
    require(static_cast<bool>(decoded), "what was made can be stored");
    const double self = score(*decoded, *decoded, {});
    require(self > 0.99 && self <= 1.0, "a shape is alike to itself");
    return 0;
}
