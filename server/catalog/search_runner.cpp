#include "server/catalog/search_runner.h"

#include <utility>

#include <oneapi/tbb/task_arena.h>

#include "core/base/return_if_error.h"

namespace shapedb::catalog {

struct SearchRunner::Arena {
    explicit Arena(int threads) : tasks(threads) {}
    oneapi::tbb::task_arena tasks;
};

SearchRunner::SearchRunner(int threads) : arena_(std::make_unique<Arena>(threads)) {}

SearchRunner::~SearchRunner() = default;

Result<VerifiedResult> SearchRunner::run(const VerifiableQuery& query, const SignatureSet& set,
                                         const SearchOptions& options,
                                         const std::optional<VerifyOptions>& verify,
                                         const SurfaceOf& surfaceOf, const RunContext& context) {
    SearchOptions own = options;
    own.excludeId = query.excludeId;
    auto result = arena_->tasks.execute([&]() -> Result<VerifiedResult> {
        if (verify && query.surface) {
            return topKVerified(query.signature, *query.surface, set, own, *verify, surfaceOf, context);
        }
        auto found = topK(query.signature, set, own, context);
        RETURN_IF_ERROR(found);
        return unverified(std::move(*found));
    });
    if (result) count_.fetch_add(1);
    return result;
}

Result<std::vector<VerifiedResult>> SearchRunner::runBatch(
    const std::vector<VerifiableQuery>& queries, const SignatureSet& set, const SearchOptions& options,
    const std::optional<VerifyOptions>& verify, const SurfaceOf& surfaceOf, const RunContext& context) {
    std::vector<VerifiedResult> results;
    if (verify) {
        // One after another: each spreads its fits over all threads.
        for (std::size_t i = 0; i < queries.size(); ++i) {
            auto result = run(queries[i], set, options, verify, surfaceOf, context);
            if (!result) return fail(ofQuery(i, result.error()));
            results.push_back(std::move(*result));
        }
        return results;
    }
    const std::vector<BatchQuery> plain(queries.begin(), queries.end());
    auto found = arena_->tasks.execute([&] { return topKBatch(plain, set, options, context); });
    RETURN_IF_ERROR(found);
    for (SearchResult& one : *found) results.push_back(unverified(std::move(one)));
    count_.fetch_add(results.size());
    return results;
}

}  // namespace shapedb::catalog
