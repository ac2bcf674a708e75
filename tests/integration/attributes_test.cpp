// SPDX-License-Identifier: GPL-3.0-or-later
// The default profile on a live server: quality of the interior, attributes, terms of a score.
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "tests/integration/support/live_test.h"

namespace shapedb::testing {
namespace {

/// The points that a scanner above the shape sees.
Scan fromAbove(const Scan& scan) {
    Scan seen;
    for (std::size_t i = 0; i + 2 < scan.size(); i += 3) {
        if (scan[i + 2] > 0.0f) seen.insert(seen.end(), {scan[i], scan[i + 1], scan[i + 2]});
    }
    return seen;
}

/// A collection with the recommended parameters beside the one of the test, which has the paper's.
class AttributesRpc : public LiveTest {
  protected:
    AttributesRpc() : recommended(collection + "-default") {
        const auto created = createCollection(client, recommended, pb::PROFILE_DEFAULT);
        EXPECT_TRUE(created.ok()) << created;
    }

    Reply<pb::GetSignatureResponse> signatureOf(const std::string& inCollection, const std::string& key) {
        pb::GetSignatureRequest request;
        request.mutable_shape()->set_collection(inCollection);
        request.mutable_shape()->set_key(key);
        return unary(*client.shapes, &pb::ShapeService::Stub::GetSignature, request);
    }

    std::string recommended;
};

TEST_F(AttributesRpc, ReportsQualityWithEveryShape) {
    const Scan closed = dumbbell(1, 4'000);
    const auto added = addAndWait(client, recommended, "closed", closed);
    ASSERT_TRUE(added.ok()) << added;
    ASSERT_TRUE(added.value.shape().has_quality());
    const double quality = added.value.shape().quality();
    EXPECT_GT(quality, 0.8);
    EXPECT_LE(quality, 1.0);
    const auto half = addAndWait(client, recommended, "half", fromAbove(closed));
    ASSERT_TRUE(half.ok()) << half;
    EXPECT_EQ(half.value.shape().state(), pb::SHAPE_STATE_READY);
    EXPECT_LT(half.value.shape().quality(), quality);

    EXPECT_EQ(getShape(client, recommended, "closed").value.quality(), quality);
    for (const pb::Shape& shape : listAll(client, recommended)) {
        EXPECT_EQ(shape.quality(), shape.key() == "closed" ? quality : half.value.shape().quality());
    }
    pb::WatchIngestRequest watch;
    watch.mutable_shape()->set_collection(recommended);
    watch.mutable_shape()->set_key("closed");
    CallContext context;
    const auto reader = client.shapes->WatchIngest(&context, watch);
    const auto events = testing::drain(context, *reader);
    ASSERT_EQ(events.messages.size(), 1u) << events;
    EXPECT_EQ(events.messages[0].quality(), quality);
    EXPECT_EQ(signatureOf(recommended, "closed").value.signature().attributes().quality(), quality);
    const auto found = searchByScan(client, searchOptions(recommended), closed);
    ASSERT_TRUE(found.ok()) << found;
    ASSERT_GE(found.value.hits_size(), 1);
    EXPECT_EQ(found.value.hits(0).shape().quality(), quality);
    EXPECT_NEAR(found.value.report().quality(), quality, 0.5 / 255.0);
    EXPECT_EQ(found.value.query().attributes().quality(), quality);
    EXPECT_EQ(found.value.query().attributes().statistics_size(), 0) << "a query is not repeated in full";
}

// The paper profile does not rate interiors: no figure is better than a meaningless one.
TEST_F(AttributesRpc, PaperProfileHasNoAttributes) {
    const auto added = addAndWait(client, collection, "k", dumbbell());
    ASSERT_TRUE(added.ok()) << added;
    EXPECT_FALSE(added.value.shape().has_quality());
    EXPECT_FALSE(signatureOf(collection, "k").value.signature().has_attributes());
}

TEST_F(AttributesRpc, SignatureEqualsTheLibrarys) {
    const Scan scan = dumbbell(3, 4'000);
    ASSERT_TRUE(addAndWait(client, recommended, "k", scan).ok());
    const auto expected = describe(unpack(scan), parametersOf(Profile::kDefault));
    ASSERT_TRUE(expected);
    ASSERT_TRUE(expected->signature.attributes.has_value());
    const auto reply = signatureOf(recommended, "k");
    ASSERT_TRUE(reply.ok()) << reply;
    EXPECT_EQ(reply.value.signature().encoded(), encodeSignature(expected->signature));
    const pb::ShapeAttributes& attributes = reply.value.signature().attributes();
    ASSERT_EQ(static_cast<std::size_t>(attributes.statistics_size()), kStatistics.size());
    for (std::size_t i = 0; i < kStatistics.size(); ++i) {
        const pb::ShapeStatistic& statistic = attributes.statistics(static_cast<int>(i));
        EXPECT_EQ(statistic.name(), kStatistics[i].name);
        EXPECT_EQ(statistic.shares_size(), kStatistics[i].count);
    }

    pb::SegmentHeader header;
    header.set_profile(pb::PROFILE_DEFAULT);
    header.set_summary_only(true);
    const auto stateless = segmentScan(client, header, scan);
    ASSERT_TRUE(stateless.ok()) << stateless;
    const pb::SegmentationSummary& summary = stateless.messages[0].summary();
    EXPECT_EQ(summary.signature().encoded(), reply.value.signature().encoded());
    EXPECT_EQ(summary.report().quality(), expected->segmentation.quality);
    EXPECT_EQ(summary.report().outliers(), expected->segmentation.outliers);
    EXPECT_EQ(summary.report().noise(), expected->segmentation.noise);
    EXPECT_EQ(summary.report().angle_degrees(), expected->segmentation.angleDegrees);
    EXPECT_NE(summary.report().interior_source(), pb::INTERIOR_SOURCE_UNSPECIFIED);
}

TEST_F(AttributesRpc, TermsAddUpToTheScore) {
    ASSERT_TRUE(addAndWait(client, recommended, "a", dumbbell(1, 4'000)).ok());
    ASSERT_TRUE(addAndWait(client, recommended, "b", familyScan("mug", 1, 1)).ok());
    pb::CompareRequest request;
    request.mutable_query()->set_collection(recommended);
    request.mutable_query()->set_key("a");
    *request.mutable_other() = request.query();
    request.mutable_other()->set_key("b");
    const auto compared = unary(*client.searches, &pb::SearchService::Stub::Compare, request);
    ASSERT_TRUE(compared.ok()) << compared;
    const auto decoded = [&](const char* key) {
        return *decodeSignature(signatureOf(recommended, key).value.signature().encoded());
    };
    const Explanation expected = explain(decoded("a"), decoded("b"), {});
    EXPECT_EQ(compared.value.signature_score(), expected.score);
    const auto& terms = compared.value.explanation().terms();
    ASSERT_EQ(static_cast<std::size_t>(terms.size()), expected.terms.size() + 1);
    EXPECT_EQ(terms.rbegin()->name(), "fit");
    double weights = terms.rbegin()->weight();
    double distance = weights * terms.rbegin()->distance();
    for (int i = 0; i + 1 < terms.size(); ++i) {
        distance += terms[i].weight() * terms[i].distance();
        EXPECT_EQ(terms[i].name(), expected.terms[static_cast<std::size_t>(i)].name);
        EXPECT_EQ(terms[i].distance(), expected.terms[static_cast<std::size_t>(i)].distance);
        weights += terms[i].weight();
    }
    EXPECT_NEAR(weights, 1.0, 1e-9);
    EXPECT_NEAR(compared.value.score(), 1.0 / (1.0 + 4.0 * distance * distance), 1e-9);

    pb::SearchByKeyRequest search;
    *search.mutable_options() = searchOptions(recommended);
    search.set_key("a");
    const auto found = unary(*client.searches, &pb::SearchService::Stub::SearchByKey, search);
    ASSERT_TRUE(found.ok()) << found;
    ASSERT_EQ(found.value.hits_size(), 1);
    // The fit is one more term of a verified score, which follows from all of them.
    const pb::Hit& hit = found.value.hits(0);
    ASSERT_TRUE(hit.has_fit());
    EXPECT_EQ(found.value.candidates_verified(), 1u);
    EXPECT_EQ(hit.signature_score(), expected.score);
    EXPECT_EQ(hit.score(), compared.value.score()) << "compare says what a search says";
    ASSERT_EQ(hit.explanation().terms_size(), terms.size());
    EXPECT_EQ(hit.explanation().terms(terms.size() - 1).name(), "fit");
    double mean = 0.0;
    for (const pb::ScoreTerm& term : hit.explanation().terms()) mean += term.weight() * term.distance();
    EXPECT_NEAR(hit.score(), scoreOfDistance(mean), 1e-9);
    EXPECT_EQ(hit.explanation().motion().SerializeAsString(), hit.fit().best().motion().SerializeAsString());

    search.mutable_options()->set_verify(false);
    const auto plain = unary(*client.searches, &pb::SearchService::Stub::SearchByKey, search);
    ASSERT_TRUE(plain.ok()) << plain;
    EXPECT_FALSE(plain.value.hits(0).has_fit());
    EXPECT_EQ(plain.value.hits(0).score(), expected.score);
    EXPECT_EQ(plain.value.hits(0).explanation().terms_size(), terms.size() - 1);
    EXPECT_EQ(plain.value.candidates_verified(), 0u);
}

TEST_F(AttributesRpc, AVerifiedScanSaysHowItsHitLies) {
    ASSERT_TRUE(addAndWait(client, recommended, "mug", familyScan("mug", 1, 1)).ok());
    const auto found = searchByScan(client, searchOptions(recommended), familyScan("mug", 1, 2));
    ASSERT_TRUE(found.ok()) << found;
    ASSERT_EQ(found.value.hits_size(), 1);
    const pb::Hit& hit = found.value.hits(0);
    ASSERT_TRUE(hit.has_fit());
    EXPECT_GT(hit.score(), 0.8);
    EXPECT_GT(hit.fit().best().explained_query(), 0.7);
    EXPECT_LT(hit.fit().best().residual(), 0.02);
    EXPECT_FALSE(found.value.not_exact());
    EXPECT_EQ(found.value.pending(), 0u);
}

// A view from one side is contained in the whole, not the other way round.
TEST_F(AttributesRpc, PartialOptionChangesTheScoreAndHasADirection) {
    const Scan whole = dumbbell(1, 4'000);
    ASSERT_TRUE(addAndWait(client, recommended, "whole", whole).ok());
    ASSERT_TRUE(addAndWait(client, recommended, "half", fromAbove(whole)).ok());
    const auto decoded = [&](const char* key) {
        return *decodeSignature(signatureOf(recommended, key).value.signature().encoded());
    };
    const Signature signatures[2] = {decoded("half"), decoded("whole")};
    const char* keys[2] = {"half", "whole"};
    ScoreOptions partial;
    partial.partial = true;
    for (int i = 0; i < 2; ++i) {
        const double expected = score(signatures[i], signatures[1 - i], partial);
        pb::CompareRequest request;
        request.mutable_query()->set_collection(recommended);
        request.mutable_query()->set_key(keys[i]);
        *request.mutable_other() = request.query();
        request.mutable_other()->set_key(keys[1 - i]);
        request.set_partial(true);
        const auto compared = unary(*client.searches, &pb::SearchService::Stub::Compare, request);
        ASSERT_TRUE(compared.ok()) << compared;
        EXPECT_EQ(compared.value.signature_score(), expected) << keys[i];

        pb::SearchByKeyRequest search;
        *search.mutable_options() = searchOptions(recommended);
        search.mutable_options()->set_partial(true);
        search.set_key(keys[i]);
        const auto found = unary(*client.searches, &pb::SearchService::Stub::SearchByKey, search);
        ASSERT_TRUE(found.ok()) << found;
        ASSERT_EQ(found.value.hits_size(), 1);
        EXPECT_EQ(found.value.hits(0).signature_score(), expected) << keys[i];
        EXPECT_TRUE(found.value.hits(0).has_fit());
    }
}

}  // namespace
}  // namespace shapedb::testing
