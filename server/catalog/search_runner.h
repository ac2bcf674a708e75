// Runs searches on a limited number of processors.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/error.h"
#include "core/search/top_k.h"

namespace shapedb::catalog {

/// All searches share the threads of one arena, however many calls run. Thread-safe.
class SearchRunner {
  public:
    /// `threads` at least 1.
    explicit SearchRunner(int threads);
    ~SearchRunner();

    /// As `shapedb::topK`.
    [[nodiscard]] Result<SearchResult> run(const Signature& query, const SignatureSet& set,
                                           const SearchOptions& options, const RunContext& context);

    /// As `shapedb::topKBatch`.
    [[nodiscard]] Result<std::vector<SearchResult>> runBatch(const std::vector<BatchQuery>& queries,
                                                             const SignatureSet& set,
                                                             const SearchOptions& options,
                                                             const RunContext& context);

    /// Successful searches since start.
    [[nodiscard]] std::uint64_t count() const { return count_.load(); }

  private:
    struct Arena;
    std::unique_ptr<Arena> arena_;
    std::atomic<std::uint64_t> count_{0};
};

}  // namespace shapedb::catalog
