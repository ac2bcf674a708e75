// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/shard_candidates.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/fit/surface_points_codec.h"
#include "core/signature/signature_codec.h"
#include "server/cluster/inbox.h"

namespace shapedb::cluster {

namespace {

using Clock = RunContext::Clock;

/// How long a search looks for holders of shards that have none.
constexpr std::chrono::milliseconds kPatience{1'000};
/// The same where a holder has said that it still reads changes: after a rebuild, all signatures.
constexpr std::chrono::milliseconds kPatienceWhileReading{60'000};
/// Between two looks at who holds what, while some shards have no holder.
constexpr std::chrono::milliseconds kBetweenRoutes{50};

/// Whether another server would say the same.
bool isFinal(ErrorCode code) {
    switch (code) {
        case ErrorCode::kInvalidArgument:
        case ErrorCode::kMalformedFilter:
        case ErrorCode::kMalformedSignature: return true;
        default: return false;
    }
}

}  // namespace

/// One request to all shards, until it is answered for each of them once.
class ShardCandidates::Scatter {
  public:
    Scatter(const ShardCandidates& of, const FindRequest& request, const RunContext& context)
        : of_(of),
          request_(request),
          context_(context),
          gather_(of.parts_.member.routes(), of.search_.atLeast, of.search_.generation, of.turn_) {}

    Result<std::vector<Candidates>> run() {
        send(gather_.start());
        while (!gather_.complete()) {
            RETURN_IF_ERROR(context_.checkpoint());
            if (gather_.needsRoutes()) {
                const auto mayGoOn = lookForHolders();
                RETURN_IF_ERROR(mayGoOn);
                if (!*mayGoOn) break;
            }
            if (auto entry = inbox_.take()) RETURN_IF_ERROR(receive(entry->first, std::move(entry->second)));
        }
        return accepted();
    }

  private:
    void send(const std::vector<Ask>& asks) {
        const auto until = std::min(context_.deadline, Clock::now() + of_.parts_.member.term());
        const Ask* own = nullptr;
        for (const Ask& ask : asks) {
            asks_[ask.id] = ask;
            if (ask.server == of_.parts_.member.name()) {
                own = &ask;
                continue;
            }
            FindRequest request = request_;
            request.ask = ask;
            requests_.add(of_.parts_.transport.find(
                ask.server, request, until,
                [this, id = ask.id](Result<FindAnswer> answer) { inbox_.put(id, std::move(answer)); }));
        }
        if (own == nullptr) return;
        FindRequest request = request_;
        request.ask = *own;
        inbox_.put(own->id, of_.parts_.own.find(request, context_));
    }

    /// False: the answer is about the shards that have one. Errors: kUnavailable.
    Result<bool> lookForHolders() {
        const auto now = Clock::now();
        if (!since_) since_ = now;
        const bool waits = isReading_ && !of_.search_.allowPartial;
        if (now - *since_ >= (waits ? kPatienceWhileReading : kPatience)) {
            if (of_.search_.allowPartial) return false;
            return fail(
                ErrorCode::kUnavailable,
                std::to_string(kShards - gather_.covered().count()) + " of " + std::to_string(kShards) +
                    " shards of the collection have no server that can answer for them now: it is gone, "
                    "or still reads what has changed; try again");
        }
        if (now < nextLook_) return true;
        nextLook_ = now + kBetweenRoutes;
        // What cannot be read now is tried again.
        if (auto routes = of_.parts_.member.readRoutes()) send(gather_.onRoutes(std::move(*routes)));
        return true;
    }

    Result<void> receive(std::uint64_t id, Result<FindAnswer> answer) {
        if (!answer) {
            RETURN_IF_ERROR(context_.checkpoint());
            if (isFinal(answer.error().code)) return fail(answer.error());
            isReading_ |= answer.error().code == ErrorCode::kNotReady;
            send(gather_.onFailure(id));
            return {};
        }
        if (answer->coverage.generation > of_.search_.generation) {
            of_.superseded_ = true;
            return fail(ErrorCode::kNotReady, "a rebuild of the collection is being put in place: try again");
        }
        auto more = gather_.onAnswer(id, answer->coverage);
        answers_[id] = std::move(answer->found);
        send(more);
        return {};
    }

    std::vector<Candidates> accepted() {
        std::vector<Candidates> parts;
        for (const std::uint64_t id : gather_.accepted()) {
            parts.push_back(std::move(answers_[id]));
            for (const auto& [shard, epoch] : asks_[id].shards) {
                of_.holders_[static_cast<std::size_t>(shard)] = asks_[id].server;
            }
        }
        of_.covered_ = std::min(of_.covered_, static_cast<double>(gather_.covered().count()) / kShards);
        return parts;
    }

    const ShardCandidates& of_;
    const FindRequest& request_;
    const RunContext& context_;
    Gather gather_;
    std::map<std::uint64_t, Ask> asks_;
    std::map<std::uint64_t, Candidates> answers_;
    std::optional<Clock::time_point> since_;  ///< some shard has no holder
    bool isReading_ = false;                  ///< some holder did not know all yet
    Clock::time_point nextLook_{};
    Inbox<FindAnswer> inbox_;
    Requests requests_;  ///< last: their answers go to the inbox
};

ShardCandidates::ShardCandidates(Parts parts, const ShardSearch& search, const Signature& query,
                                 const SurfacePoints* surface, const ScoreOptions& score)
    : parts_(parts), search_(search), scorer_(makeScorer(query, score)), turn_(parts.member.nextTurn()) {
    auto travelling = std::make_shared<ShardQuery>();
    travelling->collectionId = search.collectionId;
    travelling->signature = encodeSignature(query);
    if (surface != nullptr) travelling->surface = encodeSurfacePoints(*surface);
    travelling->score = score;
    travelling->background = search.background;
    query_ = std::move(travelling);
}

Result<std::vector<Candidates>> ShardCandidates::gather(const CandidateSearch& search,
                                                        const std::optional<std::vector<OwnGroup>>& among,
                                                        const RunContext& context) const {
    const FindRequest request{{}, query_, search, among};
    return Scatter(*this, request, context).run();
}

Result<Candidates> ShardCandidates::find(const CandidateSearch& search, const RunContext& context) const {
    context.report("search", 0, 0);
    auto parts = gather(search, std::nullopt, context);
    RETURN_IF_ERROR(parts);
    return merged(std::move(*parts), search);
}

Result<std::vector<Candidate>> ShardCandidates::findOfGroups(const SearchOptions& options,
                                                             const std::vector<OwnGroup>& groups,
                                                             const RunContext& context) const {
    auto parts = gather({options}, groups, context);
    RETURN_IF_ERROR(parts);
    std::vector<std::vector<Candidate>> found;
    for (Candidates& part : *parts) found.push_back(std::move(part.ofGroups));
    return mergedOfGroups(std::move(found), groups.size(), options.grouping->perGroup);
}

/// Each shape where its shard is held; what that server does not do is done here.
Result<FitAnswer> ShardCandidates::lay(const std::vector<FittedShape>& shapes, const FitOptions& options,
                                       bool preferUnmirrored, const RunContext& context) const {
    std::map<std::string, std::vector<std::size_t>> places;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        places[holders_[static_cast<std::size_t>(shardOf(shapes[i].id))]].push_back(i);
    }
    const auto until = std::min(context.deadline, Clock::now() + parts_.member.term());
    FitAnswer all(shapes.size());
    std::vector<std::pair<const std::vector<std::size_t>*, FitRequest>> asked;
    Inbox<FitAnswer> inbox;
    Requests requests;
    std::vector<std::size_t> here;
    for (const auto& [server, indices] : places) {
        if (server.empty() || server == parts_.member.name()) {
            here.insert(here.end(), indices.begin(), indices.end());
            continue;
        }
        FitRequest request{query_, {}, options, preferUnmirrored};
        for (const std::size_t i : indices) request.shapes.push_back(shapes[i]);
        const std::uint64_t id = asked.size();
        asked.emplace_back(&indices, std::move(request));
        requests.add(parts_.transport.fit(
            server, asked.back().second, until,
            [&inbox, id](Result<FitAnswer> answer) { inbox.put(id, std::move(answer)); }));
    }
    const auto layHere = [&](const std::vector<std::size_t>& indices) -> Result<void> {
        if (indices.empty()) return {};
        FitRequest request{query_, {}, options, preferUnmirrored};
        for (const std::size_t i : indices) request.shapes.push_back(shapes[i]);
        auto fits = parts_.own.fit(request, context);
        RETURN_IF_ERROR(fits);
        for (std::size_t n = 0; n < indices.size(); ++n) all[indices[n]] = std::move((*fits)[n]);
        return {};
    };
    RETURN_IF_ERROR(layHere(here));
    for (std::size_t open = asked.size(); open > 0;) {
        RETURN_IF_ERROR(context.checkpoint());
        auto entry = inbox.take();
        if (!entry) continue;
        --open;
        const std::vector<std::size_t>& indices = *asked[entry->first].first;
        Result<FitAnswer>& fits = entry->second;
        if (!fits || fits->size() != indices.size()) {
            RETURN_IF_ERROR(layHere(indices));
            continue;
        }
        for (std::size_t n = 0; n < indices.size(); ++n) all[indices[n]] = std::move((*fits)[n]);
    }
    return all;
}

Result<FitAnswer> ShardCandidates::fitAll(const std::vector<std::int64_t>& ids, const FitOptions& options,
                                          const RunContext& context) const {
    std::vector<FittedShape> shapes;
    for (const std::int64_t id : ids) shapes.push_back({id, nullptr});
    return lay(shapes, options, false, context);
}

Result<FitAnswer> ShardCandidates::preferUnmirroredAll(const std::vector<FittedShape>& shapes,
                                                       const FitOptions& options,
                                                       const RunContext& context) const {
    return lay(shapes, options, true, context);
}

}  // namespace shapedb::cluster
