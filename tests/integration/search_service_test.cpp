// SPDX-License-Identifier: GPL-3.0-or-later
// SearchService on a live server, against scores computed here by plain loops.
#include <algorithm>
#include <future>

#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

using grpc::StatusCode;

constexpr const char* kFamilies[] = {"dumbbell", "human", "mug", "hammer"};
constexpr int kMembers = 3;

/// A small labelled collection; the same in each test, made once.
class SearchRpc : public LiveTest {
  protected:
    SearchRpc() {
        collection = "gallery";
        if (createCollection(client, collection).ok()) fill();
        for (const pb::Shape& shape : listAll(client, collection)) {
            pb::GetSignatureRequest request;
            request.mutable_shape()->set_collection(collection);
            request.mutable_shape()->set_key(shape.key());
            const auto reply = unary(*client.shapes, &pb::ShapeService::Stub::GetSignature, request);
            EXPECT_TRUE(reply.ok()) << reply;
            const auto signature = decodeSignature(reply.value.signature().encoded());
            EXPECT_TRUE(signature);
            gallery.push_back({shape, *signature, reply.value.signature().encoded()});
        }
    }

    void fill() {
        for (const char* family : kFamilies) {
            for (int i = 0; i < kMembers; ++i) {
                const auto index = static_cast<std::size_t>(i);
                const auto added =
                    addAndWait(client, collection, std::string(family) + "/" + std::to_string(i),
                               familyScan(family, index), {{"label", family}, {"number", std::to_string(i)}});
                ASSERT_TRUE(added.ok()) << added;
                ASSERT_EQ(added.value.shape().state(), pb::SHAPE_STATE_READY);
            }
        }
    }

    struct Entry {
        pb::Shape shape;
        Signature signature;
        std::string encoded;
    };

    const Entry& entry(const std::string& key) const {
        return *std::find_if(gallery.begin(), gallery.end(),
                             [&](const Entry& e) { return e.shape.key() == key; });
    }

    struct Expected {
        double score;
        std::int64_t id;
    };

    /// All pairs, sorted: the server must return the same bits.
    std::vector<Expected> bruteForce(const Signature& query, const ScoreOptions& options,
                                     const std::function<bool(const Entry&)>& accept = nullptr) const {
        std::vector<Expected> all;
        for (const Entry& e : gallery) {
            if (!accept || accept(e)) all.push_back({score(query, e.signature, options), e.shape.id()});
        }
        std::sort(all.begin(), all.end(), [](const Expected& a, const Expected& b) {
            return a.score != b.score ? a.score > b.score : a.id < b.id;
        });
        return all;
    }

    static void expectHits(const pb::SearchResponse& response, std::vector<Expected> expected,
                           std::size_t k) {
        expected.resize(std::min(k, expected.size()));
        ASSERT_EQ(static_cast<std::size_t>(response.hits_size()), expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) {
            EXPECT_EQ(response.hits(static_cast<int>(i)).score(), expected[i].score) << i;
            EXPECT_EQ(response.hits(static_cast<int>(i)).shape().id(), expected[i].id) << i;
        }
    }

    Reply<pb::SearchResponse> byKey(const std::string& key, pb::SearchOptions options, bool self = false) {
        pb::SearchByKeyRequest request;
        *request.mutable_options() = options;
        request.set_key(key);
        request.set_include_self(self);
        return unary(*client.searches, &pb::SearchService::Stub::SearchByKey, request);
    }

    std::vector<Entry> gallery;
};

TEST_F(SearchRpc, ByKeyEqualsBruteForce) {
    ASSERT_EQ(gallery.size(), 12u);
    for (const Entry& query : gallery) {
        for (const std::uint32_t k : {1u, 5u, 50u}) {
            const auto reply = byKey(query.shape.key(), searchOptions(collection, k));
            ASSERT_TRUE(reply.ok()) << reply;
            expectHits(reply.value,
                       bruteForce(query.signature, {},
                                  [&](const Entry& e) { return e.shape.id() != query.shape.id(); }),
                       k);
            EXPECT_EQ(reply.value.candidates(), 12u);
            EXPECT_EQ(reply.value.filtered(), 11u);
            EXPECT_LE(reply.value.scored(), 11u);
        }
    }
}

TEST_F(SearchRpc, SelfMatchScoresOneAndRanksFirst) {
    const auto reply = byKey("mug/1", searchOptions(collection), true);
    ASSERT_TRUE(reply.ok()) << reply;
    EXPECT_EQ(reply.value.hits(0).shape().key(), "mug/1");
    EXPECT_EQ(reply.value.hits(0).score(), 1.0);
    EXPECT_EQ(reply.value.query().encoded(), entry("mug/1").encoded);
}

TEST_F(SearchRpc, FilterAndThresholdAreExact) {
    const Entry& query = entry("human/0");
    pb::SearchOptions options = searchOptions(collection, 2);
    options.set_filter("label=mug, number>=1");
    const auto filtered = byKey("human/0", options);
    ASSERT_TRUE(filtered.ok()) << filtered;
    expectHits(filtered.value,
               bruteForce(query.signature, {},
                          [](const Entry& e) {
                              return e.shape.metadata().at("label") == "mug" &&
                                     e.shape.metadata().at("number") != "0";
                          }),
               2);
    EXPECT_EQ(filtered.value.filtered(), 2u);

    const auto all =
        bruteForce(query.signature, {}, [&](const Entry& e) { return e.shape.id() != query.shape.id(); });
    options = searchOptions(collection, 50);
    options.set_threshold(all[3].score);
    const auto above = byKey("human/0", options);
    ASSERT_TRUE(above.ok()) << above;
    EXPECT_EQ(above.value.hits_size(), 4) << "the threshold itself passes";
}

TEST_F(SearchRpc, ScoreOptionsChangeTheScore) {
    for (const bool forbidReflection : {false, true}) {
        for (const bool keepScale : {false, true}) {
            pb::SearchOptions options = searchOptions(collection, 50);
            options.set_forbid_reflection(forbidReflection);
            options.set_keep_scale(keepScale);
            for (const bool partial : {false, true}) {
                options.set_partial(partial);
                const auto reply = byKey("human/1", options, true);
                ASSERT_TRUE(reply.ok()) << reply;
                ScoreOptions own;
                own.reflection = !forbidReflection;
                own.keepScale = keepScale;
                own.partial = partial;
                expectHits(reply.value, bruteForce(entry("human/1").signature, own), 50);
            }
        }
    }
}

TEST_F(SearchRpc, ByScanSegmentsTheQueryLikeTheLibrary) {
    const Scan scan = familyScan("hammer", 1, 99);
    const auto reply = searchByScan(client, searchOptions(collection, 50), scan);
    ASSERT_TRUE(reply.ok()) << reply;
    const auto expected = describe(unpack(scan), parametersOf(Profile::kPaper));
    ASSERT_TRUE(expected);
    EXPECT_EQ(reply.value.query().encoded(), encodeSignature(expected->signature));
    EXPECT_EQ(reply.value.report().points(), scan.size() / 3);
    EXPECT_EQ(reply.value.report().segments(), expected->segmentation.segments.size());
    EXPECT_GT(reply.value.seconds_segment(), 0.0);
    expectHits(reply.value, bruteForce(expected->signature, {}), 50);
    EXPECT_EQ(listAll(client, collection).size(), 12u) << "a query is not stored";
}

TEST_F(SearchRpc, InStagesTheAnswerIsTheSameAndLast) {
    const Scan scan = familyScan("hammer", 1, 99);
    const auto plain = searchByScan(client, searchOptions(collection, 50), scan);
    ASSERT_TRUE(plain.ok()) << plain;
    const auto told = searchInStages(client, searchOptions(collection, 50), scan);
    ASSERT_TRUE(told.ok()) << told;
    const pb::SearchResponse& answer = told.messages.back().response();
    ASSERT_EQ(answer.hits_size(), plain.value.hits_size());
    for (int i = 0; i < answer.hits_size(); ++i) {
        EXPECT_EQ(answer.hits(i).shape().key(), plain.value.hits(i).shape().key());
        EXPECT_EQ(answer.hits(i).score(), plain.value.hits(i).score());
    }
    std::vector<std::string> names;
    for (const pb::SearchByScanEvent& message : told.messages) {
        const std::string& stage = message.stage().stage();
        if (message.has_stage() && (names.empty() || names.back() != stage)) names.push_back(stage);
    }
    std::vector<std::string> expected{"queued"};
    for (const pb::StageTime& stage : answer.report().stages()) expected.push_back(stage.stage());
    expected.emplace_back("search");
    EXPECT_EQ(names, expected);

    const auto refused = searchInStages(client, searchOptions("nosuch", 50), scan);
    EXPECT_EQ(refused.error, "not_found") << refused;
    EXPECT_TRUE(refused.messages.empty());
}

TEST_F(SearchRpc, BySignatureAndBatchAgreeWithByKey) {
    pb::SearchBySignatureRequest bySignature;
    *bySignature.mutable_options() = searchOptions(collection, 7);
    bySignature.set_signature(entry("dumbbell/2").encoded);
    const auto one = unary(*client.searches, &pb::SearchService::Stub::SearchBySignature, bySignature);
    ASSERT_TRUE(one.ok()) << one;
    expectHits(one.value, bruteForce(entry("dumbbell/2").signature, {}), 7);
    EXPECT_EQ(one.value.hits(0).score(), 1.0);

    pb::SearchBatchRequest batch;
    *batch.mutable_options() = searchOptions(collection, 7);
    batch.add_queries()->set_key("human/2");
    batch.add_queries()->set_signature(entry("dumbbell/2").encoded);
    const auto both = unary(*client.searches, &pb::SearchService::Stub::SearchBatch, batch);
    ASSERT_TRUE(both.ok()) << both;
    ASSERT_EQ(both.value.responses_size(), 2);
    expectHits(
        both.value.responses(0),
        bruteForce(entry("human/2").signature, {}, [](const Entry& e) { return e.shape.key() != "human/2"; }),
        7);
    expectHits(both.value.responses(1), bruteForce(entry("dumbbell/2").signature, {}), 7);
}

TEST_F(SearchRpc, ExplanationAddsUpToTheScore) {
    const Entry& query = entry("mug/0");
    const auto reply = byKey("mug/0", searchOptions(collection, 3));
    ASSERT_TRUE(reply.ok()) << reply;
    for (const pb::Hit& hit : reply.value.hits()) {
        const Explanation expected = explain(query.signature, entry(hit.shape().key()).signature, {});
        const pb::Explanation& got = hit.explanation();
        EXPECT_EQ(got.similarity(), expected.similarity);
        EXPECT_EQ(got.dissimilarity(), expected.dissimilarity);
        EXPECT_EQ(got.motion().scale(), expected.motion.scale);
        EXPECT_EQ(got.motion().reflected(), expected.motion.reflected);
        ASSERT_EQ(got.motion().rotation_size(), 9);
        for (int i = 0; i < 9; ++i) {
            EXPECT_EQ(
                got.motion().rotation(i),
                expected.motion.rotation[static_cast<std::size_t>(i / 3)][static_cast<std::size_t>(i % 3)]);
        }
        EXPECT_EQ(got.motion().translation().y(), expected.motion.translation.y);
        ASSERT_EQ(static_cast<std::size_t>(got.matches_size()), expected.matches.size());
        for (int i = 0; i < got.matches_size(); ++i) {
            const PointMatch& match = expected.matches[static_cast<std::size_t>(i)];
            EXPECT_EQ(got.matches(i).query_segment(), match.a);
            EXPECT_EQ(got.matches(i).hit_segment(), match.b);
            EXPECT_EQ(got.matches(i).share(), match.share);
        }
        EXPECT_EQ(static_cast<std::size_t>(got.unmatched_query_size()), expected.unmatchedA.size());
        EXPECT_EQ(static_cast<std::size_t>(got.unmatched_hit_size()), expected.unmatchedB.size());
    }
    pb::SearchOptions bare = searchOptions(collection, 3);
    bare.set_no_explanation(true);
    EXPECT_FALSE(byKey("mug/0", bare).value.hits(0).has_explanation());
}

TEST_F(SearchRpc, CompareExplainsTwoShapes) {
    pb::CompareRequest request;
    request.mutable_query()->set_collection(collection);
    request.mutable_query()->set_key("human/0");
    request.mutable_other()->set_collection(collection);
    request.mutable_other()->set_key("hammer/2");
    const auto reply = unary(*client.searches, &pb::SearchService::Stub::Compare, request);
    ASSERT_TRUE(reply.ok()) << reply;
    EXPECT_EQ(reply.value.score(), score(entry("human/0").signature, entry("hammer/2").signature, {}));
    EXPECT_EQ(reply.value.query().encoded(), entry("human/0").encoded);
    EXPECT_EQ(reply.value.other().encoded(), entry("hammer/2").encoded);
    *request.mutable_other() = request.query();
    EXPECT_EQ(unary(*client.searches, &pb::SearchService::Stub::Compare, request).value.score(), 1.0);
    request.mutable_other()->set_key("nobody");
    const auto missing = unary(*client.searches, &pb::SearchService::Stub::Compare, request);
    EXPECT_EQ(missing.status.error_code(), StatusCode::NOT_FOUND);
    EXPECT_EQ(missing.status.error_message().rfind("other:", 0), 0u) << missing;
}

TEST_F(SearchRpc, EmptyCollectionHasNoHits) {
    ASSERT_TRUE(createCollection(client, "empty").ok());
    const auto reply = searchByScan(client, searchOptions("empty"), dumbbell());
    ASSERT_TRUE(reply.ok()) << reply;
    EXPECT_EQ(reply.value.hits_size(), 0);
}

TEST_F(SearchRpc, MetadataChangesAreSearchedAtOnce) {
    ASSERT_TRUE(createCollection(client, "relabelled").ok());
    ASSERT_TRUE(addAndWait(client, "relabelled", "k", dumbbell(), {{"label", "a"}}).ok());
    pb::SearchOptions options = searchOptions("relabelled");
    options.set_filter("label=b");
    EXPECT_EQ(searchByScan(client, options, dumbbell(2)).value.hits_size(), 0);
    ASSERT_TRUE(addAndWait(client, "relabelled", "k", dumbbell(), {{"label", "b"}}).ok());
    EXPECT_EQ(searchByScan(client, options, dumbbell(2)).value.hits_size(), 1);
}

TEST_F(SearchRpc, ParallelSearchesAgree) {
    std::vector<std::future<bool>> same;
    const auto expected = byKey("mug/2", searchOptions(collection, 50)).value;
    for (int i = 0; i < 8; ++i) {
        same.push_back(std::async(std::launch::async, [&] {
            Client own(server()->address());
            for (int repeat = 0; repeat < 20; ++repeat) {
                pb::SearchByKeyRequest request;
                *request.mutable_options() = searchOptions(collection, 50);
                request.set_key("mug/2");
                const auto reply = unary(*own.searches, &pb::SearchService::Stub::SearchByKey, request);
                if (!reply.ok() || reply.value.hits_size() != expected.hits_size()) return false;
                for (int h = 0; h < expected.hits_size(); ++h) {
                    if (reply.value.hits(h).SerializeAsString().size() !=
                            expected.hits(h).SerializeAsString().size() ||
                        reply.value.hits(h).score() != expected.hits(h).score() ||
                        reply.value.hits(h).shape().id() != expected.hits(h).shape().id()) {
                        return false;
                    }
                }
            }
            return true;
        }));
    }
    for (auto& result : same) EXPECT_TRUE(result.get());
}

}  // namespace
}  // namespace shapedb::testing
