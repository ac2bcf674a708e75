#include "server/catalog/search_runner.h"

#include <oneapi/tbb/task_arena.h>

namespace shapedb::catalog {

struct SearchRunner::Arena {
    explicit Arena(int threads) : tasks(threads) {}
    oneapi::tbb::task_arena tasks;
};

SearchRunner::SearchRunner(int threads) : arena_(std::make_unique<Arena>(threads)) {}

SearchRunner::~SearchRunner() = default;

Result<SearchResult> SearchRunner::run(const Signature& query, const SignatureSet& set,
                                       const SearchOptions& options, const RunContext& context) {
    Result<SearchResult> result = arena_->tasks.execute([&] { return topK(query, set, options, context); });
    if (result) count_.fetch_add(1);
    return result;
}

Result<std::vector<SearchResult>> SearchRunner::runBatch(const std::vector<BatchQuery>& queries,
                                                         const SignatureSet& set,
                                                         const SearchOptions& options,
                                                         const RunContext& context) {
    auto results = arena_->tasks.execute([&] { return topKBatch(queries, set, options, context); });
    if (results) count_.fetch_add(results->size());
    return results;
}

}  // namespace shapedb::catalog
