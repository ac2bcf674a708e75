// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/shard_holder.h"

#include <utility>
#include <vector>

#include "core/base/return_if_error.h"
#include "core/fit/surface_points_codec.h"
#include "core/signature/signature_codec.h"

namespace shapedb::cluster {

Result<FindAnswer> ShardHolder::find(const FindRequest& request, const RunContext& context) const {
    const auto signature = decodeSignature(request.query->signature);
    RETURN_IF_ERROR(signature);
    const auto shown = parts_.member.content(request.query->collectionId, request.ask, context);
    RETURN_IF_ERROR(shown);
    std::vector<SignatureSet> asked;
    for (const auto& [shard, epoch] : request.ask.shards) {
        asked.push_back((*shown)->shards[static_cast<std::size_t>(shard)]);
    }
    const SignatureSet set = SignatureSet::ofParts(asked);
    const auto source = SetCandidates::make(*signature, nullptr, request.query->score, set, parts_.surfaceOf);
    RETURN_IF_ERROR(source);
    FindAnswer answer;
    answer.coverage = {request.ask.shards, (*shown)->content.number, (*shown)->content.generation};
    const auto search = [&]() -> Result<void> {
        if (request.among) {
            auto more = source->findOfGroups(request.search.options, *request.among, context);
            RETURN_IF_ERROR(more);
            answer.found.ofGroups = std::move(*more);
            return {};
        }
        auto found = source->find(request.search, context);
        RETURN_IF_ERROR(found);
        answer.found = std::move(*found);
        return {};
    };
    const auto done = parts_.run(request.query->background, search);
    RETURN_IF_ERROR(done);
    return answer;
}

Result<FitAnswer> ShardHolder::fit(const FitRequest& request, const RunContext& context) const {
    const auto signature = decodeSignature(request.query->signature);
    RETURN_IF_ERROR(signature);
    const auto surface = decodeSurfacePoints(request.query->surface);
    RETURN_IF_ERROR(surface);
    const SignatureSet none;
    const auto source =
        SetCandidates::make(*signature, &*surface, request.query->score, none, parts_.surfaceOf);
    RETURN_IF_ERROR(source);
    FitAnswer fits;
    const auto lay = [&]() -> Result<void> {
        std::vector<std::int64_t> ids;
        for (const FittedShape& shape : request.shapes) ids.push_back(shape.id);
        auto answer = request.preferUnmirrored
                          ? source->preferUnmirroredAll(request.shapes, request.options, context)
                          : source->fitAll(ids, request.options, context);
        RETURN_IF_ERROR(answer);
        fits = std::move(*answer);
        return {};
    };
    const auto done = parts_.run(request.query->background, lay);
    RETURN_IF_ERROR(done);
    return fits;
}

}  // namespace shapedb::cluster
