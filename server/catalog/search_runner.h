// SPDX-License-Identifier: GPL-3.0-or-later
// Runs searches on a limited number of processors.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/search/verify.h"
#include "server/catalog/background_lane.h"

namespace shapedb::catalog {

/// Single searches share the threads of one arena, however many calls run; batches share as many threads of
/// low priority. Thread-safe.
class SearchRunner {
  public:
    using OnFound = std::function<Result<void>(std::size_t query, VerifiedResult result)>;

    /// `threads` at least 1.
    explicit SearchRunner(int threads);
    ~SearchRunner();

    /// As `shapedb::topKVerified`, or as `shapedb::topK` without `verify` or for a query without surface.
    [[nodiscard]] Result<VerifiedResult> run(const VerifiableQuery& query, const SignatureSet& set,
                                             const SearchOptions& options,
                                             const std::optional<VerifyOptions>& verify,
                                             const SurfaceOf& surfaceOf, const RunContext& context);

    /// The same for many, one on each thread, beside which single searches keep their speed. `onFound(i,
    /// result)` is called for each, in no order and by several threads at a time. The first error ends all
    /// and names its query.
    [[nodiscard]] Result<void> runBatch(const std::vector<VerifiableQuery>& queries, const SignatureSet& set,
                                        const SearchOptions& options,
                                        const std::optional<VerifyOptions>& verify,
                                        const SurfaceOf& surfaceOf, const RunContext& context,
                                        const OnFound& onFound);
    /// Runs `work` with the priority of batches; it may throw. Errors: those of `work`.
    [[nodiscard]] Result<void> inBackground(const std::function<Result<void>()>& work);
    /// Runs `work` with that of single searches.
    [[nodiscard]] Result<void> inForeground(const std::function<Result<void>()>& work);

    /// The same searches where other servers hold the signatures: on the thread of the caller, who waits for
    /// them. `source` must be of this query.
    [[nodiscard]] Result<VerifiedResult> runFrom(const CandidateSource& source, const VerifiableQuery& query,
                                                 const SearchOptions& options,
                                                 const std::optional<VerifyOptions>& verify,
                                                 const RunContext& context);

    /// Successful searches since start.
    [[nodiscard]] std::uint64_t count() const { return count_.load(); }

  private:
    struct Arena;
    std::unique_ptr<Arena> arena_;
    BackgroundLane lane_;
    std::atomic<std::uint64_t> count_{0};
};

}  // namespace shapedb::catalog
