// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/shape_output.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/cli/local_result.h"
#include "core/base/math.h"
#include "core/base/random.h"
#include "core/signature/signature.h"

namespace shapedb::cli {
namespace {

Matrix3 aboutZ(double degrees) {
    const double angle = toRadians(degrees);
    return {
        {{std::cos(angle), -std::sin(angle), 0.0}, {std::sin(angle), std::cos(angle), 0.0}, {0.0, 0.0, 1.0}}};
}

client::Signature signatureOf(const std::vector<double>& shares) {
    client::Signature signature;
    for (const double share : shares) {
        client::WeightedPoint point;
        point.volumeShare = share;
        signature.points.push_back(point);
    }
    return signature;
}

TEST(ShapeOutput, RotationAngleInDegrees) {
    for (const double degrees : {0.0, 1.0, 37.0, 90.0, 179.0}) {
        Motion motion;
        motion.rotation = aboutZ(degrees);
        EXPECT_NEAR(rotationDegrees(motion), degrees, 1e-6);
    }
}

TEST(ShapeOutput, RotationAngleDoesNotDependOnTheAxis) {
    Random random(3);
    for (int i = 0; i < 20; ++i) {
        // Conjugating with a rotation turns the axis and leaves the angle.
        Motion frame;
        frame.rotation = randomRotation(random);
        Motion turn;
        turn.rotation = aboutZ(50.0);
        EXPECT_NEAR(rotationDegrees(compose(frame, compose(turn, inverse(frame)))), 50.0, 1e-6);
    }
}

TEST(ShapeOutput, AMirrorAloneIsNoRotation) {
    Motion mirror;
    mirror.reflected = true;
    mirror.rotation = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, -1.0}}};
    EXPECT_NEAR(rotationDegrees(mirror), 0.0, 1e-6);

    Motion turn;
    turn.rotation = aboutZ(30.0);  // about the mirror's normal
    EXPECT_NEAR(rotationDegrees(compose(turn, mirror)), 30.0, 1e-6);
}

TEST(ShapeOutput, ExplanationListsPairsMotionAndUnmatchedParts) {
    client::Explanation explanation;
    explanation.matches = {{0, 1, 0.9, 0.0}, {2, 0, 0.09, 0.02}, {3, 2, 0.009, 0.1}, {4, 3, 0.001, 0.1}};
    explanation.unmatchedQuery = {1};
    explanation.unmatchedHit = {4, 5, 6};
    explanation.motion.rotation = aboutZ(37.0);
    explanation.motion.scale = 2.5;
    const std::string text =
        explanationText(explanation, signatureOf({0.5, 0.2, 0.15, 0.1, 0.05}), "the query", "cup-7");
    EXPECT_EQ(text,
              "4 of 5 parts of the query match (80 % of its volume)\n"
              "  part 1 <-> part 2: 90 % of the match, centres 0 % apart\n"
              "  part 3 <-> part 1: 9 % of the match, centres 2 % apart\n"
              "  and 2 more below 1 %\n"
              "To match, cup-7 is turned by 37 degrees and scaled by 2.5.\n"
              "Unmatched: part 2 of the query (20 % of its volume) and parts 5, 6 and 7 of cup-7.\n");
}

TEST(ShapeOutput, ExplanationOfAMirroredShapeOfTheSameSize) {
    client::Explanation explanation;
    explanation.matches = {{0, 0, 1.0, 0.0}};
    explanation.motion.reflected = true;
    explanation.motion.rotation = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, -1.0}}};
    EXPECT_EQ(explanationText(explanation, signatureOf({1.0}), "a", "b"),
              "1 of 1 part of a match (100 % of its volume)\n"
              "  part 1 <-> part 1: 100 % of the match, centres 0 % apart\n"
              "To match, b is mirrored.\n");
}

TEST(ShapeOutput, ExplanationOfAShapeInTheSamePose) {
    client::Explanation explanation;
    explanation.matches = {{0, 0, 1.0, 0.0}};
    EXPECT_EQ(explanationText(explanation, signatureOf({1.0}), "a", "b"),
              "1 of 1 part of a match (100 % of its volume)\n"
              "  part 1 <-> part 1: 100 % of the match, centres 0 % apart\n"
              "b is in the same pose.\n");
}

TEST(ShapeOutput, ExplanationOfADegenerateOrEmptyMatch) {
    client::Explanation explanation;
    EXPECT_EQ(explanationText(explanation, signatureOf({1.0}), "a", "b"),
              "no part of a matches a part of b\n");
    explanation.matches = {{0, 0, 1.0, 0.0}};
    explanation.degenerate = true;
    EXPECT_NE(explanationText(explanation, signatureOf({1.0}), "a", "b").find("single part"),
              std::string::npos);
    // A server that names a segment the signature does not have must not crash the client.
    explanation.matches = {{7, 9, 1.0, 0.0}};
    explanation.unmatchedQuery = {100};
    EXPECT_FALSE(explanationText(explanation, signatureOf({1.0}), "a", "b").empty());
}

TEST(ShapeOutput, SignatureJsonHasTheDocumentedKeys) {
    client::Signature signature = signatureOf({1.0});
    signature.points[0].position = {1.0, 2.0, 3.0};
    signature.points[0].extents = {3.0, 2.0, 1.0};
    const nlohmann::json points = pointsJson(signature);
    ASSERT_EQ(points.size(), 1u);
    EXPECT_EQ(points[0]["position"], nlohmann::json({1.0, 2.0, 3.0}));
    EXPECT_EQ(points[0]["extents"], nlohmann::json({3.0, 2.0, 1.0}));
    for (const char* key : {"weight", "volume_share", "peak_radius"})
        EXPECT_TRUE(points[0].contains(key)) << key;
}

TEST(ShapeOutput, PreparationTextAccountsForUnusedPoints) {
    client::SegmentationReport report;
    report.points = report.pointsUsed = 1000;
    EXPECT_EQ(preparationText(report), "");
    report.pointsUsed = 990;
    report.outliers = 10;
    EXPECT_EQ(preparationText(report), "990 points used: 10 outliers dropped\n");
    report.duplicates = 1;
    report.pointsUsed = 500;
    EXPECT_EQ(preparationText(report),
              "500 points used: 10 outliers dropped, 1 duplicate merged, the rest averaged and thinned\n");
    report.outlierClusters = 2;
    EXPECT_NE(preparationText(report).find("10 outliers dropped (with 2 separate clusters), 1 dup"),
              std::string::npos);
    report.outliers = report.duplicates = report.outlierClusters = 0;
    EXPECT_EQ(preparationText(report), "500 points used: averaged and thinned\n");
    report.duplicates = 500;
    EXPECT_EQ(preparationText(report), "500 points used: 500 duplicates merged\n");
}

TEST(ShapeOutput, QualityTextWarnsBelowOneHalf) {
    EXPECT_EQ(qualityText(0.937), "interior quality 0.94 of 1\n");
    EXPECT_NE(qualityText(0.1).find("guess"), std::string::npos);
}

TEST(ShapeOutput, ReportInJson) {
    client::SegmentationReport report;
    report.outliers = 3;
    report.quality = 0.25;
    report.interiorSource = InteriorSource::kThickened;
    report.noise = 0.5;
    const nlohmann::json document = toJson(report);
    EXPECT_EQ(document["outliers"], 3);
    EXPECT_EQ(document["strays"], 3) << "the former name stays";
    EXPECT_EQ(document["outlier_clusters"], 0);
    EXPECT_EQ(document["quality"], 0.25);
    EXPECT_EQ(document["interior_source"], "thickened");
    EXPECT_EQ(document["angle_degrees"], 0.0);
    EXPECT_EQ(document["estimated_noise"], 0.5);
}

TEST(ShapeOutput, InteriorTextNamesSourceNoiseAndQuality) {
    client::SegmentationReport report;
    report.angleDegrees = 22.0;
    report.quality = 0.75;
    EXPECT_EQ(interiorText(report, 10.0),
              "interior found by walking in from outside (22 degrees)\ninterior quality 0.75 of 1\n");
    report.noise = 0.01;
    EXPECT_EQ(interiorText(report, 10.0),
              "interior found by walking in from outside (22 degrees), noise about 0.1 % of the size\n"
              "interior quality 0.75 of 1\n");
    report.interiorSource = InteriorSource::kPotential;
    EXPECT_EQ(interiorText(report, 10.0)
                  .rfind("interior estimated: the scan is open or noisy (noise about 0.1 %", 0),
              0u);
    report.noise = 0.0;
    EXPECT_EQ(interiorText(report, 10.0),
              "interior estimated: the scan is open or noisy\ninterior quality 0.75 of 1\n");
    report.interiorSource = InteriorSource::kThickened;
    EXPECT_EQ(interiorText(report, 10.0).rfind("no interior found", 0), 0u);
}

TEST(ShapeOutput, ASegmentMatchedTwiceCountsOnceAndTermsAreListed) {
    client::Explanation explanation;
    explanation.matches = {{0, 1, 0.6, 0.0}, {0, 2, 0.4, 0.0}};
    explanation.terms = {{"chords", 0.123, 0.5}, {"parts", 1.0, 0.5}};
    const std::string text = explanationText(explanation, signatureOf({0.5, 0.2}), "a", "b");
    EXPECT_EQ(text.rfind("1 of 2 parts of a match (50 % of its volume)\n  part 1 <-> part 2: ", 0), 0u)
        << text;
    EXPECT_NE(
        text.find("Differences (0 = identical, 1 = typical of unrelated shapes): chords 0.12, parts 1.00.\n"),
        std::string::npos)
        << text;
    const nlohmann::json document = toJson(explanation);
    EXPECT_EQ(document["terms"][1], nlohmann::json({{"name", "parts"}, {"distance", 1.0}, {"weight", 0.5}}));
}

TEST(ShapeOutput, AttributesAreShownByStatistic) {
    client::Signature signature = signatureOf({1.0});
    EXPECT_EQ(statisticsTable(signature), "");
    EXPECT_TRUE(statisticsJson(signature).empty());
    EXPECT_FALSE(toJson(signature).contains("quality"));
    signature.attributes.emplace();
    signature.attributes->quality = 0.75;
    signature.attributes->statistics = {
        {"chords", {0.0f, 0.25f, 1.0f}, true}, {"nothing", {0.0f}, false}, {"no bins", {}, false}};
    const std::string table = statisticsTable(signature);
    EXPECT_NE(table.find("chords"), std::string::npos);
    EXPECT_NE(table.find(" ▄█"), std::string::npos) << "roots of shares: " << table;
    EXPECT_EQ(statisticsJson(signature)["chords"], nlohmann::json({0.0, 0.25, 1.0}));
    EXPECT_EQ(toJson(signature)["quality"], 0.75);
}

TEST(LocalResult, SignatureIsWhatTheServerWouldSend) {
    Signature signature;
    signature.points.resize(1);
    EXPECT_FALSE(toClient(signature).attributes.has_value());
    signature.attributes.emplace();
    signature.attributes->quality = 51;
    signature.attributes->statistics[0] = 15;
    const client::Signature told = toClient(signature);
    ASSERT_TRUE(told.attributes.has_value());
    EXPECT_NEAR(told.attributes->quality, 0.2, 1e-12);
    ASSERT_EQ(told.attributes->statistics.size(), kStatistics.size());
    EXPECT_EQ(told.attributes->statistics[0].name, "chords");
    EXPECT_EQ(told.attributes->statistics[0].shares[0], 0.5f);
    EXPECT_EQ(told.attributes->statistics[0].shares[1], 0.0f);
}

TEST(ShapeOutput, WritesAFailedShapeAsJson) {
    client::Shape shape;
    shape.key = "cup";
    shape.sha256 = std::string("\x00\xff\x1a", 3);
    shape.state = client::ShapeState::kFailed;
    shape.failure = Error{ErrorCode::kNoInterior, "open"};
    shape.created = client::Timestamp(std::chrono::seconds(86400));
    const nlohmann::json document = toJson(shape);
    EXPECT_EQ(document["key"], "cup");
    EXPECT_EQ(document["sha256"], "00ff1a");
    EXPECT_EQ(document["state"], "failed");
    EXPECT_EQ(document["failure"]["name"], "no_interior");
    EXPECT_EQ(document["created"], "1970-01-02T00:00:00Z");
    EXPECT_FALSE(toJson(client::Shape{}).contains("failure"));
    EXPECT_FALSE(toJson(client::Shape{}).contains("quality"));
    shape.quality = 0.5;
    EXPECT_EQ(toJson(shape)["quality"], 0.5);
}

}  // namespace
}  // namespace shapedb::cli
