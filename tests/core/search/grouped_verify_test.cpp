// SPDX-License-Identifier: GPL-3.0-or-later
// Verified searches with groups against a plain reference: fit everything, sort, and take hit after hit.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/pipeline.h"
#include "core/search/verify.h"
#include "core/synthetic/families.h"

namespace shapedb {
namespace {

struct LabelledScan {
    std::optional<std::string> label;
    Signature signature;
    std::shared_ptr<const SurfacePoints> surface;
};

LabelledScan labelledScan(const char* family, std::size_t member, std::uint64_t seed) {
    ScanOptions options;
    options.count = 2000;
    options.noise = 0.002;
    options.seed = seed;
    const PointCloud points = scanOf(makeMember(family, member, 1).value(), options).value();
    return {family, describe(points, parametersOf(Profile::kDefault)).value().signature,
            std::make_shared<const SurfacePoints>(makeSurfacePoints(points).value())};
}

struct LabelledGallery {
    std::map<std::int64_t, LabelledScan> shapes;
    SignatureSet set;
    LabelledScan query;
};

// Three scans of each family; those of tables have no label.
const LabelledGallery& labelledGallery() {
    static const LabelledGallery made = [] {
        LabelledGallery gallery;
        std::vector<IndexEntry> entries;
        for (const char* family : {"hammer", "animal", "table"}) {
            for (std::size_t member = 0; member < 3; ++member) {
                const auto id = static_cast<std::int64_t>(10 * (gallery.shapes.size() + 1));
                LabelledScan& shape = gallery.shapes[id];
                shape = labelledScan(family, member, 5 + static_cast<std::uint64_t>(id));
                IndexEntry entry;
                entry.id = id;
                entry.signature = shape.signature;
                if (*shape.label == "table") {
                    shape.label.reset();
                } else {
                    entry.metadata["label"] = *shape.label;
                }
                entries.push_back(entry);
            }
        }
        gallery.set = SignatureSet().with(entries, {});
        gallery.query = labelledScan("hammer", 0, 1);
        return gallery;
    }();
    return made;
}

Result<VerifiedResult> searchedInGroups(const SearchOptions& options, std::size_t most) {
    const LabelledGallery& gallery = labelledGallery();
    const SurfaceOf surfaces = [&](std::int64_t id) -> Result<std::shared_ptr<const SurfacePoints>> {
        return gallery.shapes.at(id).surface;
    };
    return topKVerified(gallery.query.signature, *gallery.query.surface, gallery.set, options, {most},
                        surfaces);
}

std::vector<VerifiedHit> plainVerifiedGroups(const SearchOptions& options) {
    const LabelledGallery& gallery = labelledGallery();
    const LabelledScan& query = gallery.query;
    const QueryTraits traits = traitsOf(query.signature, *query.surface, options.score).value();
    std::vector<VerifiedHit> ranked;
    for (const auto& [id, shape] : gallery.shapes) {
        VerifiedHit hit;
        hit.id = id;
        hit.signatureScore = makeScorer(query.signature, options.score)->score(shape.signature);
        const FitOptions fitOptions{kindsOfQuery(traits), options.score.keepScale, options.score.reflection};
        const double misfit = fit(FitQuery(*query.surface), *shape.surface, fitOptions).value().misfit;
        hit.score = verifiedScore(hit.signatureScore, misfit, misfitShare(traits, options.score));
        if (hit.score >= options.threshold) ranked.push_back(hit);
    }
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const VerifiedHit& a, const VerifiedHit& b) { return a.score > b.score; });
    std::vector<std::optional<std::string>> order;
    std::map<std::optional<std::string>, std::vector<VerifiedHit>> groups;
    for (const VerifiedHit& hit : ranked) {
        const auto& label = gallery.shapes.at(hit.id).label;
        if (groups.count(label) == 0) {
            if (order.size() == options.k) continue;
            order.push_back(label);
        }
        if (groups[label].size() < options.grouping->perGroup) groups[label].push_back(hit);
    }
    std::vector<VerifiedHit> hits;
    for (const auto& label : order) hits.insert(hits.end(), groups[label].begin(), groups[label].end());
    return hits;
}

TEST(GroupedVerify, FindsTheGroupsOfAPlainRanking) {
    for (const std::size_t k : {1u, 2u, 5u}) {
        for (const std::size_t perGroup : {1u, 2u, 9u}) {
            for (const double threshold : {0.0, 0.3}) {
                SCOPED_TRACE("k " + std::to_string(k) + " of each " + std::to_string(perGroup));
                SearchOptions options;
                options.k = k;
                options.threshold = threshold;
                options.grouping = Grouping{"label", perGroup};
                const auto found = searchedInGroups(options, 100);
                ASSERT_TRUE(found) << found.error().message;
                EXPECT_TRUE(found->exact);
                const auto expected = plainVerifiedGroups(options);
                ASSERT_EQ(found->hits.size(), expected.size());
                for (std::size_t i = 0; i < expected.size(); ++i) {
                    EXPECT_EQ(found->hits[i].id, expected[i].id) << i;
                    EXPECT_EQ(found->hits[i].score, expected[i].score) << i;
                    EXPECT_TRUE(found->hits[i].fit) << i;
                }
            }
        }
    }
}

// The three hammers have the best signatures: without groups nothing else would be verified.
TEST(GroupedVerify, VerifiesTheBestOfEachGroup) {
    SearchOptions options;
    options.k = 3;
    options.grouping = Grouping{"label", 1};
    const auto found = searchedInGroups(options, 4);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_LE(found->verified, 4u);
    ASSERT_EQ(found->hits.size(), 3u);
    EXPECT_EQ(labelledGallery().shapes.at(found->hits[0].id).label, "hammer");
    for (const VerifiedHit& hit : found->hits) EXPECT_TRUE(hit.fit) << hit.id;
    tbb::task_arena alone(1);
    const auto narrow = alone.execute([&] { return searchedInGroups(options, 4); });
    ASSERT_TRUE(narrow);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(narrow->hits[i].id, found->hits[i].id);
}

}  // namespace
}  // namespace shapedb
