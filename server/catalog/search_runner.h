// Runs searches on a limited number of processors.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/search/verify.h"

namespace shapedb::catalog {

/// All searches share the threads of one arena, however many calls run. Thread-safe.
class SearchRunner {
  public:
    /// `threads` at least 1.
    explicit SearchRunner(int threads);
    ~SearchRunner();

    /// As `shapedb::topKVerified`, or as `shapedb::topK` without `verify` or for a query without surface.
    [[nodiscard]] Result<VerifiedResult> run(const VerifiableQuery& query, const SignatureSet& set,
                                             const SearchOptions& options,
                                             const std::optional<VerifyOptions>& verify,
                                             const SurfaceOf& surfaceOf, const RunContext& context);

    /// The same for many; the first error ends all and names its query. Results in the order of the queries.
    [[nodiscard]] Result<std::vector<VerifiedResult>> runBatch(
        const std::vector<VerifiableQuery>& queries, const SignatureSet& set, const SearchOptions& options,
        const std::optional<VerifyOptions>& verify, const SurfaceOf& surfaceOf, const RunContext& context);

    /// Successful searches since start.
    [[nodiscard]] std::uint64_t count() const { return count_.load(); }

  private:
    struct Arena;
    std::unique_ptr<Arena> arena_;
    std::atomic<std::uint64_t> count_{0};
};

}  // namespace shapedb::catalog
