// SPDX-License-Identifier: GPL-3.0-or-later
// Fixtures of the server tests.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/pipeline.h"
#include "core/search/signature_set.h"
#include "core/signature/signature_codec.h"
#include "server/store/parameters_codec.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"
#include "tests/support/eventually.h"

namespace shapedb::testing {

/// A valid signature that is recognised by its volume (at most 1000) and weight.
inline Signature signatureOf(double volume) {
    Signature signature;
    signature.points.resize(1);
    signature.points[0].weight = static_cast<float>(volume / 1024.0);
    signature.points[0].volumeShare = 1.0f;
    signature.points[0].maximumRadius = 0.25f;
    signature.points[0].covariance = {0.01f, 0.0f, 0.0f, 0.01f, 0.0f, 0.01f};
    signature.volume = volume;
    return signature;
}

/// The volume of a signature made by `signatureOf`, as searches see it; 0 when it is not there.
inline double cachedVolume(const SignatureSet& signatures, std::int64_t id) {
    const SignatureSet::Place place = signatures.find(id);
    if (!place) return 0.0;
    return place.block->rows()[place.row].points[0].weight * 1024.0;
}

/// Points in space whose first coordinate is `tag` (flat only for -0.5).
inline std::vector<float> taggedPoints(float tag) { return {tag, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 2}; }

/// Describes without geometry: the signature's volume is the first coordinate, its scale the
/// parameters' maxPoints. A negative first coordinate has no interior.
inline Result<Description> quickDescribe(const PointCloud& points, const ShapeParameters& parameters,
                                         const RunContext& context) {
    context.report("quick", 0, 0);
    if (const auto go = context.checkpoint(); !go) return fail(go.error());
    if (points.at(0).x < 0.0) return fail(ErrorCode::kNoInterior, "negative tag");
    Description description;
    description.signature = signatureOf(points.at(0).x);
    description.signature.scale = parameters.signature.maxPoints;
    return description;
}

inline store::PutRequest putRequest(std::int64_t collectionId, const std::string& key,
                                    const std::vector<float>& points, Metadata metadata = {}) {
    store::PutRequest request(store::VerifiedScan::verify(points).value());
    request.collectionId = collectionId;
    request.key = key;
    request.metadata = store::replacedBy(std::move(metadata));
    return request;
}

inline std::string paperParameters(std::uint32_t maxPoints = 7) {
    ShapeParameters parameters = parametersOf(Profile::kPaper);
    parameters.signature.maxPoints = maxPoints;
    return store::encodeParameters(parameters);
}

/// Keeps all lines.
class RecordingLogger : public telemetry::Logger {
  public:
    void log(telemetry::Level, const std::string& message,
             const std::vector<telemetry::Field>& fields) override {
        const std::lock_guard<std::mutex> lock(mutex_);
        lines_.push_back(telemetry::formatText(message, fields));
    }
    std::string all() const {
        const std::lock_guard<std::mutex> lock(mutex_);
        std::string text;
        for (const std::string& line : lines_) text += line + "\n";
        return text;
    }

  private:
    mutable std::mutex mutex_;
    std::vector<std::string> lines_;
};

}  // namespace shapedb::testing
