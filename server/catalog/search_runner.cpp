// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/search_runner.h"

#include <utility>

#include <oneapi/tbb/task_arena.h>

#include "core/base/return_if_error.h"

namespace shapedb::catalog {
namespace {

Result<VerifiedResult> searchIn(const CandidateSource& source, const VerifiableQuery& query,
                                const SearchOptions& options, const std::optional<VerifyOptions>& verify,
                                const RunContext& context) {
    SearchOptions own = options;
    own.excludeId = query.excludeId;
    if (verify && query.surface) {
        return topKVerified(query.signature, *query.surface, source, own, *verify, context);
    }
    return topKUnverified(source, own, context);
}

Result<VerifiedResult> search(const VerifiableQuery& query, const SignatureSet& set,
                              const SearchOptions& options, const std::optional<VerifyOptions>& verify,
                              const SurfaceOf& surfaceOf, const RunContext& context) {
    RETURN_IF_ERROR(validate(options));
    const SurfacePoints* laidOn = verify ? query.surface.get() : nullptr;
    const auto source = SetCandidates::make(query.signature, laidOn, options.score, set, surfaceOf);
    RETURN_IF_ERROR(source);
    return searchIn(*source, query, options, verify, context);
}

}  // namespace

struct SearchRunner::Arena {
    explicit Arena(int threads) : tasks(threads) {}
    oneapi::tbb::task_arena tasks;
};

SearchRunner::SearchRunner(int threads) : arena_(std::make_unique<Arena>(threads)), lane_(threads) {}

SearchRunner::~SearchRunner() = default;

Result<VerifiedResult> SearchRunner::run(const VerifiableQuery& query, const SignatureSet& set,
                                         const SearchOptions& options,
                                         const std::optional<VerifyOptions>& verify,
                                         const SurfaceOf& surfaceOf, const RunContext& context) {
    auto result =
        arena_->tasks.execute([&] { return search(query, set, options, verify, surfaceOf, context); });
    if (result) count_.fetch_add(1);
    return result;
}

Result<void> SearchRunner::runBatch(const std::vector<VerifiableQuery>& queries, const SignatureSet& set,
                                    const SearchOptions& options, const std::optional<VerifyOptions>& verify,
                                    const SurfaceOf& surfaceOf, const RunContext& context,
                                    const OnFound& onFound) {
    return lane_.run(queries.size(), [&](std::size_t i) -> Result<void> {
        auto found = search(queries[i], set, options, verify, surfaceOf, context);
        if (!found) return fail(ofQuery(i, found.error()));
        count_.fetch_add(1);
        return onFound(i, std::move(*found));
    });
}

Result<VerifiedResult> SearchRunner::runFrom(const CandidateSource& source, const VerifiableQuery& query,
                                             const SearchOptions& options,
                                             const std::optional<VerifyOptions>& verify,
                                             const RunContext& context) {
    auto result = searchIn(source, query, options, verify, context);
    if (result) count_.fetch_add(1);
    return result;
}

Result<void> SearchRunner::inForeground(const std::function<Result<void>()>& work) {
    return arena_->tasks.execute(work);
}

Result<void> SearchRunner::inBackground(const std::function<Result<void>()>& work) {
    return lane_.run(1, [&](std::size_t) { return work(); });
}

}  // namespace shapedb::catalog
