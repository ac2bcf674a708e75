// SPDX-License-Identifier: GPL-3.0-or-later
// The rules of a search, whatever its transport: what a request may ask for, which signature a query
// has, which hits an answer holds and how large it may be.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/matching/explanation.h"
#include "core/search/top_k.h"
#include "server/catalog/catalog.h"
#include "server/catalog/limits.h"
#include "server/catalog/search_runner.h"
#include "server/cluster/shard_candidates.h"

namespace shapedb::catalog {

/// What a request asks for, not yet checked.
struct SearchRequest {
    std::uint32_t k = 0;
    double threshold = 0.0;
    std::string filter;
    ScoreOptions score;      ///< keepScale: also where the collection has no unit
    bool freeScale = false;  ///< sizes do not count, although the collection has a unit
    bool explain = true;
    std::optional<bool> verify;  ///< nothing: yes, but not in collections of profile `paper`
    VerifyOptions verifyOptions;
    std::string groupBy;         ///< a metadata key; empty: no groups
    std::uint32_t perGroup = 0;  ///< hits of a group at most; 0: 1
    std::int64_t atLeast = 0;    ///< a change of the collection that the answer must know
    bool allowPartial = false;   ///< where servers of shards are missing: an answer of the others
};

/// Checked options, and the snapshot that all queries of the request read.
struct PreparedSearch {
    index::SnapshotPtr collection;
    SearchOptions options;
    bool explain = true;
    std::optional<VerifyOptions> verify;
    std::uint64_t pending = 0;  ///< shapes of the collection without a signature to search, yet
    std::int64_t atLeast = 0;   ///< of searches in shards
    bool allowPartial = false;  ///< of searches in shards
    /// A search failed because a rebuild was put in place since it was prepared: prepare it again.
    std::shared_ptr<std::atomic<bool>> superseded = std::make_shared<std::atomic<bool>>(false);
};

/// What a request names as a query: one of the two. Not owned.
struct QuerySource {
    const std::string* key = nullptr;        ///< of a stored shape
    const std::string* signature = nullptr;  ///< docs/signature-format.md
};

/// A shape as a request names it.
struct ShapeName {
    std::string collection;  ///< empty: the default collection
    std::string key;
};

/// The segmentation of a scan sent as a query, and what it found.
struct ScanSearch {
    Description description;
    VerifiedResult found;
};

/// Two stored shapes, compared.
struct Comparison {
    Signature query;
    Signature other;
    VerifiedExplanation verified;
    LengthUnit unit = LengthUnit::kNone;  ///< of both collections; kNone if they differ
};

struct Alignment {
    FitResult fit;
    LengthUnit unit = LengthUnit::kNone;  ///< of the stored shape's collection; kNone of two scans
};

struct FoundHit {
    store::Shape shape;
    std::optional<double> quality;  ///< as Candidate
    double score = 0.0;
    double signatureScore = 0.0;
    std::optional<Explanation> explanation;  ///< its motion is that of `fit`, if there is one
    std::shared_ptr<const FitResult> fit;    ///< null if it was not verified
    Verdict verdict = Verdict::kNone;
    /// In a search with groups, the value that the group has in common; empty for shapes without the key.
    std::optional<std::string> group;
};

/// Thread-safe. The references must outlive it.
class Searches {
  public:
    /// `shards`: where other servers hold signatures too; nothing: all are in the catalog's index, or, where
    /// that has none, this server does not search.
    Searches(Catalog& catalog, SearchRunner& runner, std::uint32_t maxK,
             std::optional<cluster::ShardCandidates::Parts> shards = std::nullopt)
        : catalog_(catalog), runner_(runner), maxK_(maxK), shards_(shards) {}

    /// Errors: kInvalidArgument (k, threshold, what verifying takes, groups), kMalformedFilter; kDataLoss
    /// (the collection is damaged: Snapshot::damage); kUnavailable (SearchRequest::atLeast); those of the
    /// store.
    [[nodiscard]] Result<PreparedSearch> prepare(index::SnapshotPtr collection,
                                                 const SearchRequest& request) const;

    /// Lays a scan or a stored shape on a scan; stores nothing. With a stored shape `query` is taken to be in
    /// the unit of its collection; sizes then count as in a search. Errors: those of makeSurfacePoints and
    /// fit; kInvalidArgument (key), kNotFound, kNotReady (no surface points yet), kDataLoss.
    [[nodiscard]] Result<Alignment> align(const store::VerifiedScan& query,
                                          const std::variant<ShapeName, const store::VerifiedScan*>& other,
                                          FitOptions options, bool freeScale,
                                          const RunContext& context) const;

    /// A stored shape as a query, which finds itself only with `includeSelf`. If a rebuild was put in place
    /// since `search` was prepared, it searches the collection after it. Errors: kInvalidArgument (key),
    /// kNotFound, kNotReady, kDataLoss.
    [[nodiscard]] Result<VerifiableQuery> storedQuery(PreparedSearch& search, const std::string& key,
                                                      bool includeSelf = false) const;

    /// The query that `source` names; a stored shape as above. Errors: those of `storedQuery` and of
    /// decodeSignature; kInvalidArgument (not exactly one is set).
    [[nodiscard]] Result<VerifiableQuery> query(PreparedSearch& search, const QuerySource& source) const;

    /// The queries of a batch. Errors: those of `query`, named by `ofQuery`.
    [[nodiscard]] Result<std::vector<VerifiableQuery>> queries(PreparedSearch& search,
                                                               const std::vector<QuerySource>& sources) const;

    /// How alike two stored shapes are, and why. Sizes count as in a search, if both collections have the
    /// same unit. Errors, saying which of the two they are about: kInvalidArgument (key), kNotFound,
    /// kNotReady, kDataLoss; kCancelled, kDeadlineExceeded.
    [[nodiscard]] Result<Comparison> compare(const ShapeName& query, const ShapeName& other,
                                             ScoreOptions options, bool freeScale,
                                             const RunContext& context) const;

    /// Calls `visit` with each hit, best first, leaving out shapes deleted meanwhile. An explanation is
    /// missing where the signature scored was replaced meanwhile. `found` by `run` or `runBatch`. Errors:
    /// those of topK and of `visit`; kDataLoss.
    using Visit = std::function<Result<void>(const FoundHit&)>;
    [[nodiscard]] Result<void> visitHits(const PreparedSearch& search, const Signature& query,
                                         const VerifiedResult& found, const Visit& visit) const;

    /// Verified if the request says so and the query has surface points (core/search/verify.h), otherwise as
    /// `topK`; `query.excludeId` holds. Errors also: those of cluster::ShardCandidates.
    [[nodiscard]] Result<VerifiedResult> run(const PreparedSearch& search, const VerifiableQuery& query,
                                             const RunContext& context) const;
    /// Segments `scan` with the parameters of the collection, holding one of the places for segmentations
    /// only meanwhile, and searches. Errors: those of Catalog::describe and of `run`.
    [[nodiscard]] Result<ScanSearch> byScan(const PreparedSearch& search, const store::VerifiedScan& scan,
                                            const RunContext& context) const;
    /// The queries of `sources`, each found as by `run`, beside which single searches keep their speed.
    /// `onFound(i, query, result)` is called for each, in no order and by several threads at a time. An error
    /// names its query. Errors: those of `queries`, `run` and `onFound`.
    using OnFound =
        std::function<Result<void>(std::size_t i, const Signature& query, const VerifiedResult& found)>;
    [[nodiscard]] Result<void> runBatch(PreparedSearch& search, const std::vector<QuerySource>& sources,
                                        const RunContext& context, const OnFound& onFound) const;
    /// Successful searches since start.
    [[nodiscard]] std::uint64_t count() const { return runner_.count(); }

  private:
    struct Compared {
        Signature signature;
        std::shared_ptr<const SurfacePoints> surface;  ///< null if there are none
        LengthUnit unit = LengthUnit::kNone;           ///< of its collection
    };
    Result<FoundShape> shapeNamed(const ShapeName& name) const;
    Result<LengthUnit> unitOf(const ShapeName& name) const;
    Result<Compared> compared(const char* which, const ShapeName& name) const;
    static Result<std::optional<Explanation>> explain(const PreparedSearch& search, const Signature& query,
                                                      const VerifiedResult& found, const VerifiedHit& hit,
                                                      const Result<store::SignatureRow>& stored);
    static Result<FoundHit> show(const PreparedSearch& search, const Signature& query,
                                 const VerifiedResult& found, const VerifiedHit& hit,
                                 store::StoredHit stored);
    SurfaceOf surfaces() const;
    static Result<SurfacePoints> surfaceOfScan(const store::VerifiedScan& scan, const RunContext& context);
    Result<std::shared_ptr<const SurfacePoints>> surfaceOf(const ShapeName& name) const;
    Result<void> requireChanges(const SearchRequest& request, PreparedSearch& prepared) const;
    Result<VerifiedResult> runInShards(const PreparedSearch& search, const VerifiableQuery& query,
                                       bool background, const RunContext& context) const;
    Result<void> runBatchInShards(const PreparedSearch& search, const std::vector<VerifiableQuery>& queries,
                                  const RunContext& context, const OnFound& onFound) const;

    Catalog& catalog_;
    SearchRunner& runner_;
    std::uint32_t maxK_;
    std::optional<cluster::ShardCandidates::Parts> shards_;
};

}  // namespace shapedb::catalog
