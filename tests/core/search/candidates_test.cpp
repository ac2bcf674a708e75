// SPDX-License-Identifier: GPL-3.0-or-later
// A collection searched in parts, as several servers hold it, against the same collection in one set.
#include "core/search/candidates.h"

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/pipeline.h"
#include "core/search/verify.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/families.h"
#include "core/views/views.h"

namespace shapedb {
namespace {

using Surface = std::shared_ptr<const SurfacePoints>;

struct PartedShape {
    Signature signature;
    Surface surface;
};

PartedShape partedShape(const char* family, std::size_t member, std::uint64_t seed) {
    ScanOptions options;
    options.count = 1500;
    options.noise = 0.002;
    options.seed = seed;
    const PointCloud points = scanOf(makeMember(family, member, 1).value(), options).value();
    return {describe(points, parametersOf(Profile::kDefault)).value().signature,
            std::make_shared<const SurfacePoints>(makeSurfacePoints(points).value())};
}

// Shapes in three parts of different sizes, the first of which is empty, and all in one. Two groups, and
// shapes of none.
struct PartedGallery {
    std::map<std::int64_t, PartedShape> shapes;
    SignatureSet whole;
    std::vector<SignatureSet> parts;
    std::vector<PartedShape> queries;
    SurfaceOf surfaceOf = [this](std::int64_t id) -> Result<Surface> { return shapes.at(id).surface; };

    static std::size_t partOf(std::int64_t id) { return id % 7 < 2 ? 1 : (id % 7 < 5 ? 2 : 3); }

    PartedGallery() {
        std::vector<IndexEntry> all;
        std::vector<std::vector<IndexEntry>> apart(4);
        for (const char* family : {"hammer", "animal", "table", "mug", "airplane"}) {
            for (std::size_t member = 0; member < 4; ++member) {
                const auto id = static_cast<std::int64_t>(3 * shapes.size() + 1);
                PartedShape& shape = shapes[id] = partedShape(family, member, 5 + std::uint64_t(id));
                IndexEntry entry;
                entry.id = id;
                entry.signature = shape.signature;
                entry.key = family + std::to_string(member);
                entry.views = std::make_shared<const ShapeViews>(makeViews(*shape.surface, {}).value());
                if (member < 3) entry.metadata["label"] = member == 2 ? "odd" : family;
                if (id % 5 == 0) shape.surface = nullptr;
                all.push_back(entry);
                apart[partOf(id)].push_back(entry);
            }
        }
        whole = SignatureSet().with(all, {});
        for (const auto& entries : apart) parts.push_back(SignatureSet().with(entries, {}));
        queries = {partedShape("hammer", 1, 1), partedShape("table", 0, 2), shapes.at(25)};
    }
};

const PartedGallery& partedGallery() {
    static const PartedGallery gallery;
    return gallery;
}

// What a server does that asks others.
class InParts final : public CandidateSource {
  public:
    InParts(const PartedShape& query, const ScoreOptions& score) {
        const PartedGallery& gallery = partedGallery();
        for (const SignatureSet& part : gallery.parts) {
            sources_.push_back(
                SetCandidates::make(query.signature, query.surface.get(), score, part, gallery.surfaceOf)
                    .value());
        }
    }

    const std::shared_ptr<const Scorer>& scorer() const override { return sources_.front().scorer(); }

    Result<Candidates> find(const CandidateSearch& search, const RunContext& context) const override {
        std::vector<Candidates> found;
        for (const SetCandidates& source : sources_) found.push_back(source.find(search, context).value());
        return merged(std::move(found), search);
    }

    Result<std::vector<Candidate>> findOfGroups(const SearchOptions& options,
                                                const std::vector<OwnGroup>& groups,
                                                const RunContext& context) const override {
        std::vector<std::vector<Candidate>> found;
        for (const SetCandidates& source : sources_) {
            found.push_back(source.findOfGroups(options, groups, context).value());
        }
        return mergedOfGroups(std::move(found), groups.size(), options.grouping->perGroup);
    }

    Result<std::vector<std::shared_ptr<const FitResult>>> fitAll(const std::vector<std::int64_t>& ids,
                                                                 const FitOptions& options,
                                                                 const RunContext& context) const override {
        std::vector<std::shared_ptr<const FitResult>> fits;
        for (const std::int64_t id : ids) {
            fits.push_back(sources_[PartedGallery::partOf(id)].fitAll({id}, options, context).value()[0]);
        }
        return fits;
    }

    Result<std::vector<std::shared_ptr<const FitResult>>> preferUnmirroredAll(
        const std::vector<FittedShape>& shapes, const FitOptions& options,
        const RunContext& context) const override {
        std::vector<std::shared_ptr<const FitResult>> fits;
        for (const FittedShape& shape : shapes) {
            const SetCandidates& source = sources_[PartedGallery::partOf(shape.id)];
            fits.push_back(source.preferUnmirroredAll({shape}, options, context).value()[0]);
        }
        return fits;
    }

  private:
    std::vector<SetCandidates> sources_;
};

void expectSameAnswer(const VerifiedResult& parts, const VerifiedResult& whole) {
    ASSERT_EQ(parts.hits.size(), whole.hits.size());
    for (std::size_t i = 0; i < whole.hits.size(); ++i) {
        const VerifiedHit& hit = parts.hits[i];
        const VerifiedHit& expected = whole.hits[i];
        EXPECT_EQ(hit.id, expected.id) << i;
        EXPECT_EQ(hit.score, expected.score) << i;
        EXPECT_EQ(hit.signatureScore, expected.signatureScore) << i;
        EXPECT_EQ(hit.quality, expected.quality) << i;
        EXPECT_EQ(hit.verdict, expected.verdict) << i;
        ASSERT_EQ(hit.group == nullptr, expected.group == nullptr) << i;
        if (hit.group) {
            EXPECT_EQ(*hit.group, *expected.group) << i;
        }
        ASSERT_EQ(hit.fit == nullptr, expected.fit == nullptr) << i;
        if (hit.fit) {
            EXPECT_EQ(hit.fit->best.score, expected.fit->best.score) << i;
            EXPECT_EQ(hit.fit->best.motion.rotation, expected.fit->best.motion.rotation) << i;
        }
    }
    EXPECT_EQ(parts.verified, whole.verified);
    EXPECT_EQ(parts.exact, whole.exact);
    EXPECT_EQ(parts.misfitShare, whole.misfitShare);
    EXPECT_EQ(parts.counts.candidates, whole.counts.candidates);
    EXPECT_EQ(parts.counts.filtered, whole.counts.filtered);
}

SearchOptions anyOptions(Random& random) {
    SearchOptions options;
    options.k = 1 + random.below(9);
    options.threshold = random.below(3) == 0 ? 0.5 : 0.0;
    if (random.below(3) == 0) options.filter = Filter::parse("label!=animal").value();
    if (random.below(4) == 0) options.excludeId = 4;
    options.score.reflection = random.below(2) == 0;
    options.score.keepScale = random.below(3) == 0;
    options.score.partial = random.below(4) == 0;
    if (random.below(2) == 0) options.grouping = Grouping{"label", std::size_t{1} + random.below(3)};
    return options;
}

TEST(CandidatesInParts, WithoutVerifyingAreThoseOfTheWhole) {
    const PartedGallery& gallery = partedGallery();
    Random random(11);
    for (int round = 0; round < 200; ++round) {
        SCOPED_TRACE(round);
        const SearchOptions options = anyOptions(random);
        const PartedShape& query = gallery.queries[random.below(gallery.queries.size())];
        const auto set = SetCandidates::make(query.signature, query.surface.get(), options.score,
                                             gallery.whole, gallery.surfaceOf);
        const auto whole = topKUnverified(*set, options);
        const auto parts = topKUnverified(InParts(query, options.score), options);
        expectSameAnswer(*parts, *whole);

        // And both those of the plain search.
        const auto plain = topK(query.signature, gallery.whole, options);
        ASSERT_EQ(plain->hits.size(), whole->hits.size());
        for (std::size_t i = 0; i < plain->hits.size(); ++i) {
            EXPECT_EQ(plain->hits[i].id, whole->hits[i].id);
            EXPECT_EQ(plain->hits[i].score, whole->hits[i].score);
        }
    }
}

TEST(CandidatesInParts, VerifiedAreThoseOfTheWhole) {
    const PartedGallery& gallery = partedGallery();
    Random random(12);
    for (int round = 0; round < 24; ++round) {
        SCOPED_TRACE(round);
        const SearchOptions options = anyOptions(random);
        const PartedShape& query = gallery.queries[random.below(gallery.queries.size())];
        VerifyOptions verify;
        verify.mostCandidates = 1 + random.below(10);
        if (random.below(2) == 0) verify.oneSided = random.below(2) == 0;
        const Surface surface = query.surface ? query.surface : gallery.queries.front().surface;
        const PartedShape whole{query.signature, surface};
        const auto expected =
            topKVerified(query.signature, *surface, gallery.whole, options, verify, gallery.surfaceOf);
        const auto found =
            topKVerified(query.signature, *surface, InParts(whole, options.score), options, verify);
        expectSameAnswer(*found, *expected);
    }
}

}  // namespace
}  // namespace shapedb
