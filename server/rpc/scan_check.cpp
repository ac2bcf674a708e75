#include "server/rpc/scan_check.h"

#include <algorithm>
#include <array>

#include "core/base/return_if_error.h"
#include "core/preparation/sanitise.h"
#include "server/ingest/signature_pipeline.h"

namespace shapedb::rpc {
namespace {

/// Enough that a real scan spans space.
constexpr std::size_t kSamplePoints = 256;

/// Some points of the scan, among them those that decide its bounding box: what is wrong with their
/// size or magnitude is wrong with the scan's.
std::vector<float> sampleOf(const std::vector<float>& xyz) {
    const std::size_t count = xyz.size() / 3;
    std::array<std::size_t, 6> extremes{};  // lowest x, y, z; highest x, y, z
    for (std::size_t i = 1; i < count; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float value = xyz[3 * i + axis];
            if (value < xyz[3 * extremes[axis] + axis]) extremes[axis] = i;
            if (value > xyz[3 * extremes[3 + axis] + axis]) extremes[3 + axis] = i;
        }
    }
    std::vector<float> sample;
    const auto take = [&](std::size_t i) {
        for (std::size_t axis = 0; axis < 3; ++axis) sample.push_back(xyz[3 * i + axis]);
    };
    for (const std::size_t i : extremes) take(i);
    const std::size_t step = std::max<std::size_t>(1, count / kSamplePoints);
    for (std::size_t i = 0; i < count; i += step) take(i);
    return sample;
}

}  // namespace

Result<void> checkUsable(const std::vector<float>& xyz) {
    // Points that span space go on doing so when others join them.
    if (xyz.size() >= 3 && sanitise(ingest::toCloud(sampleOf(xyz)))) return {};
    const auto sanitised = sanitise(ingest::toCloud(xyz));
    RETURN_IF_ERROR(sanitised);
    return {};
}

}  // namespace shapedb::rpc
