// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/searches.h"

#include <algorithm>
#include <mutex>
#include <thread>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/matching/score.h"
#include "core/matching/scorer.h"
#include "core/signature/signature_codec.h"
#include "server/catalog/call_frame.h"
#include "server/catalog/request_checks.h"

namespace shapedb::catalog {

namespace {

// Rows read together. Each read takes locks of SQLite that all connections share, and a thread of low
// priority that is held up inside one holds up all the others: so there are few reads, each of little memory.
constexpr std::size_t kHitsAtOnce = 64;

// Queries of one batch that wait for other servers at a time.
constexpr std::size_t kQueriesAtOnce = 4;

// Whether sizes are compared, of shapes in collections with this unit.
Result<bool> sizesCount(bool keepScale, bool freeScale, LengthUnit unit) {
    if (keepScale && freeScale) {
        return fail(ErrorCode::kInvalidArgument, "keep_scale and free_scale exclude each other");
    }
    return keepScale || (unit != LengthUnit::kNone && !freeScale);
}

}  // namespace

Result<PreparedSearch> Searches::prepare(index::SnapshotPtr collection, const SearchRequest& request) const {
    if (collection->damage) return fail(*collection->damage);
    RETURN_IF_ERROR(checkK(request.k, maxK_));
    RETURN_IF_ERROR(checkThreshold(request.threshold));
    RETURN_IF_ERROR(checkFilterLength(request.filter));
    RETURN_IF_ERROR(checkVerifyOptions(request.verifyOptions));
    RETURN_IF_ERROR(checkGrouping(request.groupBy, request.perGroup, request.k, maxK_));
    Result<Filter> filter = Filter::parse(request.filter);
    RETURN_IF_ERROR(filter);
    PreparedSearch prepared;
    prepared.collection = std::move(collection);
    RETURN_IF_ERROR(requireChanges(request, prepared));
    const auto keepScale =
        sizesCount(request.score.keepScale, request.freeScale, prepared.collection->parameters.unit);
    RETURN_IF_ERROR(keepScale);
    const auto pending = catalog_.unsearchedShapes(*prepared.collection);
    RETURN_IF_ERROR(pending);
    prepared.pending = *pending;
    prepared.options.k = request.k;
    prepared.options.threshold = request.threshold;
    prepared.options.filter = std::move(*filter);
    prepared.options.score = request.score;
    prepared.options.score.keepScale = *keepScale;
    if (!request.groupBy.empty()) {
        prepared.options.grouping = Grouping{request.groupBy, std::max(1u, request.perGroup)};
    }
    prepared.explain = request.explain;
    if (request.verify.value_or(prepared.collection->parameters.profile == Profile::kDefault)) {
        prepared.verify = request.verifyOptions;
    }
    return prepared;
}

/// What the answer must know. In shards all that was committed by now: their servers look it up as they are
/// asked, so that a search finds what any server has acknowledged before.
Result<void> Searches::requireChanges(const SearchRequest& request, PreparedSearch& prepared) const {
    if (!shards_ && !catalog_.holdsSignatures()) {
        return fail(ErrorCode::kUnavailable, "this server only segments (role = worker): ask another one");
    }
    if (!shards_) {
        auto with = catalog_.withChange(prepared.collection, request.atLeast);
        RETURN_IF_ERROR(with);
        prepared.collection = std::move(*with);
        return {};
    }
    auto current = catalog_.current(prepared.collection);
    RETURN_IF_ERROR(current);
    if (request.atLeast > current->lastChange) {
        return fail(ErrorCode::kUnavailable, "at_least: the collection has " +
                                                 std::to_string(current->lastChange) + " changes, not " +
                                                 std::to_string(request.atLeast));
    }
    prepared.collection = std::move(current->collection);
    prepared.atLeast = current->lastChange;
    prepared.allowPartial = request.allowPartial;
    return {};
}

Result<VerifiableQuery> Searches::storedQuery(PreparedSearch& search, const std::string& key,
                                              bool includeSelf) const {
    auto found = catalog_.findShape(search.collection, key);
    RETURN_IF_ERROR(found);
    auto signature = catalog_.signature(*found);
    RETURN_IF_ERROR(signature);
    search.collection = found->collection;
    VerifiableQuery query{{std::move(*signature), std::nullopt}, nullptr};
    if (!includeSelf) query.excludeId = found->shape.id;
    if (search.verify) {
        auto surface = catalog_.surface(found->shape.id);
        RETURN_IF_ERROR(surface);
        query.surface = std::move(*surface);
    }
    return query;
}

Result<VerifiableQuery> Searches::query(PreparedSearch& search, const QuerySource& source) const {
    if (source.key && source.signature) {
        return fail(ErrorCode::kInvalidArgument, "both key and signature are set: leave one out");
    }
    if (source.key) return storedQuery(search, *source.key);
    if (!source.signature) return fail(ErrorCode::kInvalidArgument, "neither key nor signature is set");
    auto signature = decodeSignature(*source.signature);
    RETURN_IF_ERROR(signature);
    return VerifiableQuery{{std::move(*signature), std::nullopt}, nullptr};
}

Result<FoundShape> Searches::shapeNamed(const ShapeName& name) const {
    const auto collection = catalog_.collection(name.collection);
    RETURN_IF_ERROR(collection);
    return catalog_.findShape(*collection, name.key);
}

Result<LengthUnit> Searches::unitOf(const ShapeName& name) const {
    const auto collection = catalog_.collection(name.collection);
    RETURN_IF_ERROR(collection);
    RETURN_IF_ERROR((*collection)->requireParameters());
    return (*collection)->parameters.unit;
}

Result<Searches::Compared> Searches::compared(const char* which, const ShapeName& name) const {
    const auto read = [&]() -> Result<Compared> {
        const auto collection = catalog_.collection(name.collection);
        RETURN_IF_ERROR(collection);
        RETURN_IF_ERROR((*collection)->requireParameters());
        auto found = catalog_.findShape(*collection, name.key);
        RETURN_IF_ERROR(found);
        auto signature = catalog_.signature(*found);
        RETURN_IF_ERROR(signature);
        auto surface = catalog_.surface(found->shape.id);
        RETURN_IF_ERROR(surface);
        return Compared{std::move(*signature), std::move(*surface), found->collection->parameters.unit};
    };
    auto shape = read();
    if (!shape) return fail(withContext(shape.error(), which + std::string(": ")));
    return shape;
}

Result<std::shared_ptr<const SurfacePoints>> Searches::surfaceOf(const ShapeName& name) const {
    const auto found = shapeNamed(name);
    RETURN_IF_ERROR(found);
    auto surface = catalog_.surface(found->shape.id);
    RETURN_IF_ERROR(surface);
    if (!*surface) {
        return fail(ErrorCode::kNotReady, "shape '" + name.key +
                                              "' has no surface points (yet): it is pending, failed, or was "
                                              "stored by an older version; rebuild the collection");
    }
    return surface;
}

Result<SurfacePoints> Searches::surfaceOfScan(const store::VerifiedScan& scan, const RunContext& context) {
    auto surface = makeSurfacePoints(store::toCloud(scan.points()), context);
    if (surface) moveBy(scan.origin(), *surface);
    return surface;
}

Result<Alignment> Searches::align(const store::VerifiedScan& query,
                                  const std::variant<ShapeName, const store::VerifiedScan*>& other,
                                  FitOptions options, bool freeScale, const RunContext& context) const {
    auto unit = LengthUnit::kNone;
    if (const auto* name = std::get_if<ShapeName>(&other)) {
        const auto own = unitOf(*name);
        if (!own) return fail(withContext(own.error(), "other: "));
        unit = *own;
    }
    const auto keepScale = sizesCount(options.keepScale, freeScale, unit);
    RETURN_IF_ERROR(keepScale);
    options.keepScale = *keepScale;
    SegmentationSlots::Slot slot(catalog_.segmentationSlots());
    RETURN_IF_ERROR(slot.acquire(context));
    const auto surface = surfaceOfScan(query, context);
    if (!surface) return fail(withContext(surface.error(), "query: "));
    const auto on = [&](const SurfacePoints& laid) -> Result<Alignment> {
        auto fitted = shapedb::align(FitQuery(*surface), laid, options, context);
        RETURN_IF_ERROR(fitted);
        return Alignment{std::move(*fitted), unit};
    };
    if (const auto* name = std::get_if<ShapeName>(&other)) {
        const auto stored = surfaceOf(*name);
        if (!stored) return fail(withContext(stored.error(), "other: "));
        return on(**stored);
    }
    const store::VerifiedScan& scan = *std::get<const store::VerifiedScan*>(other);
    const auto sent = surfaceOfScan(scan, context);
    if (!sent) return fail(withContext(sent.error(), "other: "));
    return on(*sent);
}

Result<Comparison> Searches::compare(const ShapeName& query, const ShapeName& other, ScoreOptions options,
                                     bool freeScale, const RunContext& context) const {
    auto first = compared("query", query);
    RETURN_IF_ERROR(first);
    auto second = compared("other", other);
    RETURN_IF_ERROR(second);
    const bool sameUnit = first->unit == second->unit;
    if (options.keepScale && !sameUnit) {
        return fail(ErrorCode::kInvalidArgument, "keep_scale: the shapes have different units of length, " +
                                                     std::string(lengthUnitName(first->unit)) + " and " +
                                                     lengthUnitName(second->unit));
    }
    const auto unit = sameUnit ? first->unit : LengthUnit::kNone;
    const auto keepScale = sizesCount(options.keepScale, freeScale, unit);
    RETURN_IF_ERROR(keepScale);
    options.keepScale = *keepScale;
    auto verified = explainVerified(first->signature, first->surface.get(), second->signature,
                                    second->surface.get(), options, context);
    RETURN_IF_ERROR(verified);
    Comparison comparison;
    comparison.verified = std::move(*verified);
    comparison.query = std::move(first->signature);
    comparison.other = std::move(second->signature);
    comparison.unit = unit;
    return comparison;
}

Result<std::vector<VerifiableQuery>> Searches::queries(PreparedSearch& search,
                                                       const std::vector<QuerySource>& sources) const {
    while (true) {
        const std::int64_t generation = search.collection->collection.generation;
        std::vector<VerifiableQuery> queries;
        queries.reserve(sources.size());
        for (const QuerySource& source : sources) {
            auto one = query(search, source);
            if (!one) return fail(ofQuery(queries.size(), one.error()));
            queries.push_back(std::move(*one));
        }
        // A rebuild put in place between two of them: all again, so that all are of one generation.
        if (search.collection->collection.generation == generation) return queries;
    }
}

Result<VerifiedResult> Searches::run(const PreparedSearch& search, const VerifiableQuery& query,
                                     const RunContext& context) const {
    if (shards_) return runInShards(search, query, false, context);
    return runner_.run(query, search.collection->signatures, search.options, search.verify, surfaces(),
                       context);
}

Result<VerifiedResult> Searches::runInShards(const PreparedSearch& search, const VerifiableQuery& query,
                                             bool background, const RunContext& context) const {
    RETURN_IF_ERROR(validate(search.options));
    RETURN_IF_ERROR(validate(search.options.score));
    const store::Collection& collection = search.collection->collection;
    const cluster::ShardCandidates source(
        *shards_, {collection.id, collection.generation, search.atLeast, search.allowPartial, background},
        query.signature, search.verify ? query.surface.get() : nullptr, search.options.score);
    auto found = runner_.runFrom(source, query, search.options, search.verify, context);
    if (source.superseded()) search.superseded->store(true);
    if (found) found->covered = source.covered();
    return found;
}

/// A few at a time, on threads that wait for the servers, which give them the priority of batches.
Result<void> Searches::runBatchInShards(const PreparedSearch& search,
                                        const std::vector<VerifiableQuery>& queries,
                                        const RunContext& context, const OnFound& onFound) const {
    std::atomic<std::size_t> next{0};
    std::mutex mutex;
    std::size_t failedAt = queries.size();
    std::optional<Error> error;
    const auto work = [&] {
        for (std::size_t i = next++; i < queries.size(); i = next++) {
            const auto done = guarded([&]() -> Result<void> {
                const auto found = runInShards(search, queries[i], true, context);
                RETURN_IF_ERROR(found);
                return onFound(i, queries[i].signature, *found);
            });
            if (done) continue;
            const std::lock_guard<std::mutex> lock(mutex);
            next = queries.size();
            if (i >= failedAt) continue;
            failedAt = i;
            error = ofQuery(i, done.error());
        }
    };
    std::vector<std::thread> threads;
    for (std::size_t i = 1; i < std::min(kQueriesAtOnce, queries.size()); ++i) threads.emplace_back(work);
    work();
    for (std::thread& thread : threads) thread.join();
    return error ? Result<void>(fail(*error)) : Result<void>();
}

Result<ScanSearch> Searches::byScan(const PreparedSearch& search, const store::VerifiedScan& scan,
                                    const RunContext& context) const {
    const auto describe = [&] {
        SegmentationSlots::Slot slot(catalog_.segmentationSlots());
        return catalog_.describe(slot, scan, search.collection->parameters, context);
    };
    auto description = describe();
    RETURN_IF_ERROR(description);
    VerifiableQuery query{{description->signature, std::nullopt}, nullptr};
    if (search.verify) {
        auto surface = surfaceOfScan(scan, context);
        if (surface) {
            query.surface = std::make_shared<const SurfacePoints>(std::move(*surface));
        } else {
            // One without surface points has a signature: searched without verifying.
            RETURN_IF_ERROR(context.checkpoint());
        }
    }
    // Its own progress would be told on threads that all searches share, by a client that may be slow to hear
    // it.
    context.report("search", 0, 0);
    RunContext quiet = context;
    quiet.progress = nullptr;
    auto found = run(search, query, quiet);
    RETURN_IF_ERROR(found);
    return ScanSearch{std::move(*description), std::move(*found)};
}

Result<void> Searches::runBatch(PreparedSearch& search, const std::vector<QuerySource>& sources,
                                const RunContext& context, const OnFound& onFound) const {
    std::vector<VerifiableQuery> all;
    const auto read = runner_.inBackground([&]() -> Result<void> {
        auto found = queries(search, sources);
        RETURN_IF_ERROR(found);
        all = std::move(*found);
        return {};
    });
    RETURN_IF_ERROR(read);
    if (shards_) return runBatchInShards(search, all, context, onFound);
    return runner_.runBatch(all, search.collection->signatures, search.options, search.verify, surfaces(),
                            context, [&](std::size_t i, VerifiedResult found) -> Result<void> {
                                const auto done = onFound(i, all[i].signature, found);
                                return done ? done : fail(ofQuery(i, done.error()));
                            });
}

SurfaceOf Searches::surfaces() const {
    return [this](std::int64_t id) { return catalog_.surface(id); };
}

Result<std::optional<Explanation>> Searches::explain(const PreparedSearch& search, const Signature& query,
                                                     const VerifiedResult& found, const VerifiedHit& hit,
                                                     const Result<store::SignatureRow>& stored) {
    const auto signature = Catalog::decoded(*search.collection, stored);
    if (!signature && signature.error().code == ErrorCode::kDataLoss) return fail(signature.error());
    // Deleted or replaced since the search, or not readable now: a hit without reasons.
    if (!signature) return std::optional<Explanation>();
    Explanation explanation = found.scorer->explain(*signature);
    // The shape has got another signature since the search.
    if (explanation.score != hit.signatureScore) return std::optional<Explanation>();
    if (hit.fit) {
        setMotion(hit.fit->best.motion, query, *signature, explanation);
        addFit(*hit.fit, found.misfitShare, explanation);
    }
    return std::optional<Explanation>(std::move(explanation));
}

Result<FoundHit> Searches::show(const PreparedSearch& search, const Signature& query,
                                const VerifiedResult& found, const VerifiedHit& hit,
                                store::StoredHit stored) {
    FoundHit out;
    out.shape = std::move(stored.shape);
    out.quality = hit.quality;
    out.score = hit.score;
    out.signatureScore = hit.signatureScore;
    out.fit = hit.fit;
    out.verdict = hit.verdict;
    // As it was searched: the shape may have other metadata by now.
    if (hit.group) out.group = *hit.group;
    if (search.explain) {
        auto explanation = explain(search, query, found, hit, stored.signature);
        RETURN_IF_ERROR(explanation);
        out.explanation = std::move(*explanation);
    }
    return out;
}

Result<void> Searches::visitHits(const PreparedSearch& search, const Signature& query,
                                 const VerifiedResult& found, const Visit& visit) const {
    for (std::size_t begin = 0; begin < found.hits.size(); begin += kHitsAtOnce) {
        const std::size_t end = std::min(found.hits.size(), begin + kHitsAtOnce);
        std::vector<std::int64_t> ids;
        for (std::size_t i = begin; i < end; ++i) ids.push_back(found.hits[i].id);
        auto stored = catalog_.getHits(ids, search.explain);
        RETURN_IF_ERROR(stored);
        for (std::size_t i = begin; i < end; ++i) {
            auto& one = (*stored)[i - begin];
            if (!one) continue;  // deleted meanwhile
            const auto hit = show(search, query, found, found.hits[i], std::move(*one));
            RETURN_IF_ERROR(hit);
            RETURN_IF_ERROR(visit(*hit));
        }
    }
    return {};
}

}  // namespace shapedb::catalog
