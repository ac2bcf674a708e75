// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/convert.h"

#include <gtest/gtest.h>

#include "core/base/return_if_error.h"
#include "core/signature/signature_codec.h"

namespace shapedb::rpc {
namespace {

Result<ShapeParameters> parametersFrom(pb::Profile profile, const pb::SegmentationParameters& segmentation,
                                       const pb::SignatureParameters& signature,
                                       const ShapeParameters& current) {
    const auto overrides = overridesFrom(profile, segmentation, signature);
    RETURN_IF_ERROR(overrides);
    return overrides->applyTo(current);
}

TEST(ParametersFrom, SetFieldsOverrideTheBase) {
    ShapeParameters current = parametersOf(Profile::kPaper);
    current.segmentation.mergeRatio = 3.0;
    pb::SegmentationParameters segmentation;
    segmentation.set_decimate_to(0);
    segmentation.set_big_ball_ratio(0.75);
    const auto kept = parametersFrom(pb::PROFILE_UNSPECIFIED, segmentation, {}, current);
    ASSERT_TRUE(kept) << kept.error().message;
    EXPECT_EQ(kept->profile, Profile::kPaper);
    EXPECT_EQ(kept->segmentation.mergeRatio, 3.0);
    EXPECT_EQ(kept->segmentation.bigBallRatio, 0.75);

    const auto fresh = parametersFrom(pb::PROFILE_DEFAULT, segmentation, {}, current);
    ASSERT_TRUE(fresh);
    EXPECT_EQ(fresh->profile, Profile::kDefault);
    EXPECT_EQ(fresh->segmentation.mergeRatio, 1.5) << "a profile starts from its defaults";
    EXPECT_EQ(fresh->segmentation.preparation.decimateTo, 0u) << "set to 0 is not unset";
}

TEST(ParametersFrom, ConvertsEveryField) {
    pb::SegmentationParameters segmentation;
    segmentation.set_big_ball_ratio(0.6);
    segmentation.set_deep_angle_degrees(21.0);
    segmentation.set_hull_angle_degrees(6.0);
    segmentation.set_merge_ratio(1.75);
    segmentation.set_decimate_to(5'000);
    segmentation.set_merge_contrast(1.25);
    segmentation.set_min_segment_share(0.01);
    segmentation.set_max_segments(12);
    segmentation.set_outlier_ratio(3.0);
    segmentation.set_smoothing_reach(5.0);
    segmentation.set_thinning(1.0);
    segmentation.set_interior_method(pb::INTERIOR_METHOD_ADAPTIVE);
    // A field added to the message and forgotten here would show.
    const auto* fields = pb::SegmentationParameters::descriptor();
    for (int i = 0; i < fields->field_count(); ++i) {
        ASSERT_TRUE(segmentation.GetReflection()->HasField(segmentation, fields->field(i)))
            << fields->field(i)->name();
    }
    pb::SignatureParameters signature;
    signature.set_max_points(11);
    signature.set_attributes(true);
    signature.set_views(true);
    signature.set_unit(pb::LENGTH_UNIT_INCH);
    const auto parameters = parametersFrom(pb::PROFILE_PAPER, segmentation, signature, {});
    ASSERT_TRUE(parameters);
    // And back: the collection message has the same values.
    pb::Collection collection;
    toProto(store::Collection(), *parameters, &collection);
    EXPECT_EQ(collection.segmentation().SerializeAsString(), segmentation.SerializeAsString());
    EXPECT_EQ(collection.signature().SerializeAsString(), signature.SerializeAsString());
    EXPECT_EQ(collection.profile(), pb::PROFILE_PAPER);
}

TEST(ParametersFrom, RefusesUnknownProfilesAndBadValues) {
    EXPECT_FALSE(parametersFrom(static_cast<pb::Profile>(3), {}, {}, {}));
    pb::SegmentationParameters segmentation;
    segmentation.set_merge_ratio(0.99);
    const auto refused = parametersFrom(pb::PROFILE_PAPER, segmentation, {}, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
    pb::SegmentationParameters method;
    method.set_interior_method(static_cast<pb::InteriorMethod>(9));
    const auto unknown = parametersFrom(pb::PROFILE_PAPER, method, {}, {});
    ASSERT_FALSE(unknown);
    EXPECT_NE(unknown.error().message.find("interior_method"), std::string::npos);
}

TEST(ParametersFrom, UnspecifiedMethodKeepsTheBase) {
    ShapeParameters current = parametersOf(Profile::kPaper);
    current.segmentation.interiorMethod = InteriorMethod::kAdaptive;
    pb::SegmentationParameters segmentation;
    segmentation.set_interior_method(pb::INTERIOR_METHOD_UNSPECIFIED);
    const auto kept = parametersFrom(pb::PROFILE_UNSPECIFIED, segmentation, {}, current);
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->segmentation.interiorMethod, InteriorMethod::kAdaptive);
    segmentation.set_interior_method(pb::INTERIOR_METHOD_WALK);
    EXPECT_EQ(parametersFrom(pb::PROFILE_UNSPECIFIED, segmentation, {}, current)->segmentation.interiorMethod,
              InteriorMethod::kWalk);
}

TEST(Enums, ConvertBothWaysAndRefuseUnknownNumbers) {
    for (const auto state :
         {store::ShapeState::kPending, store::ShapeState::kReady, store::ShapeState::kFailed}) {
        const auto back = fromProto(toProto(state));
        ASSERT_TRUE(back && *back);
        EXPECT_EQ(**back, state);
    }
    const auto all = fromProto(pb::SHAPE_STATE_UNSPECIFIED);
    ASSERT_TRUE(all);
    EXPECT_FALSE(*all);
    EXPECT_FALSE(fromProto(static_cast<pb::ShapeState>(4)));
    EXPECT_EQ(*fromProto(pb::ADD_MODE_UNSPECIFIED), store::PutMode::kUpsert);
    EXPECT_EQ(*fromProto(pb::ADD_MODE_INSERT_ONLY), store::PutMode::kInsertOnly);
    EXPECT_EQ(*fromProto(pb::ADD_MODE_UPDATE_ONLY), store::PutMode::kUpdateOnly);
    EXPECT_EQ(*fromProto(pb::ADD_MODE_SAME_POINTS), store::PutMode::kSamePoints);
    EXPECT_FALSE(fromProto(static_cast<pb::AddMode>(5)));
    EXPECT_EQ(*fromProto(pb::SHAPE_ORDER_UNSPECIFIED), store::ShapeOrder::kId);
    EXPECT_EQ(*fromProto(pb::SHAPE_ORDER_ID), store::ShapeOrder::kId);
    EXPECT_EQ(*fromProto(pb::SHAPE_ORDER_KEY), store::ShapeOrder::kKey);
    EXPECT_EQ(*fromProto(pb::SHAPE_ORDER_UPDATED), store::ShapeOrder::kUpdated);
    EXPECT_FALSE(fromProto(static_cast<pb::ShapeOrder>(4)));
}

TEST(Timestamps, AreSplitTowardsThePast) {
    google::protobuf::Timestamp time;
    toProto(1'500, &time);
    EXPECT_EQ(time.seconds(), 1);
    EXPECT_EQ(time.nanos(), 500'000'000);
    toProto(-1, &time);
    EXPECT_EQ(time.seconds(), -1);
    EXPECT_EQ(time.nanos(), 999'000'000);
    toProto(-2'000, &time);
    EXPECT_EQ(time.seconds(), -2);
    EXPECT_EQ(time.nanos(), 0);
}

TEST(Shapes, ConvertAllFields) {
    store::Shape shape;
    shape.id = 5;
    shape.key = "k";
    shape.version = 3;
    shape.state = store::ShapeState::kFailed;
    shape.pointCount = 99;
    shape.checksum[31] = 7;
    shape.metadata = {{"label", "cup"}};
    shape.createdAt = 1'000;
    shape.updatedAt = 2'000;
    shape.failure = Error{ErrorCode::kNoInterior, "why"};
    pb::Shape message;
    toProto(shape, "parts", std::nullopt, &message);
    EXPECT_FALSE(message.has_quality());
    EXPECT_EQ(message.collection(), "parts");
    EXPECT_EQ(message.id(), 5);
    EXPECT_EQ(message.key(), "k");
    EXPECT_EQ(message.version(), 3);
    EXPECT_EQ(message.state(), pb::SHAPE_STATE_FAILED);
    EXPECT_EQ(message.point_count(), 99u);
    ASSERT_EQ(message.sha256().size(), 32u);
    EXPECT_EQ(message.sha256()[31], 7);
    EXPECT_EQ(message.metadata().at("label"), "cup");
    EXPECT_EQ(message.created().seconds(), 1);
    EXPECT_EQ(message.updated().seconds(), 2);
    EXPECT_EQ(message.failure().error(), "no_interior");
    EXPECT_EQ(message.failure().message(), "why");
}

TEST(Shapes, ReportQualityOfTheServingSignature) {
    pb::Shape plain;
    toProto(store::Shape(), "parts", std::nullopt, &plain);
    EXPECT_FALSE(plain.has_quality()) << "a signature without attributes does not rate the interior";
    store::Shape shape;
    shape.state = store::ShapeState::kReady;
    pb::Shape rated;
    toProto(shape, "parts", 0.2, &rated);
    EXPECT_NEAR(rated.quality(), 0.2, 1e-12);
    shape.state = store::ShapeState::kPending;
    pb::Shape replaced;
    toProto(shape, "parts", 0.2, &replaced);
    EXPECT_FALSE(replaced.has_quality()) << "that of points which were replaced";
}

TEST(Reports, ReportOutliersAndInteriorQuality) {
    Segmentation segmentation;
    segmentation.siteOfPoint.resize(10);
    segmentation.sites.resize(6);
    segmentation.duplicates = 1;
    segmentation.outliers = 3;
    segmentation.quality = 0.25;
    segmentation.interiorSource = InteriorSource::kPotential;
    segmentation.angleDegrees = 17.5;
    segmentation.noise = 0.125;
    pb::SegmentationReport report;
    toProto(segmentation, &report);
    EXPECT_EQ(report.points(), 10u);
    EXPECT_EQ(report.points_used(), 6u);
    EXPECT_EQ(report.duplicates(), 1u);
    EXPECT_EQ(report.outliers(), 3u);
    EXPECT_EQ(report.quality(), 0.25);
    EXPECT_EQ(report.interior_source(), pb::INTERIOR_SOURCE_POTENTIAL);
    EXPECT_EQ(report.angle_degrees(), 17.5);
    EXPECT_EQ(report.noise(), 0.125);
}

TEST(Signatures, AreInScanUnits) {
    Signature signature;
    signature.scale = 10.0;
    signature.origin = {100.0, 0.0, 0.0};
    signature.volume = 600.0;
    signature.points.resize(2);
    signature.points[0].weight = 0.4f;
    signature.points[0].volumeShare = 0.75f;
    signature.points[0].maximumRadius = 0.5f;
    signature.points[1].weight = 0.125f;
    signature.points[1].position = {0.5f, 0.0f, -1.0f};
    pb::Signature message;
    toProto(signature, &message);
    ASSERT_EQ(message.points_size(), 2);
    EXPECT_EQ(message.points(0).position().x(), 100.0);
    EXPECT_EQ(message.points(0).peak_radius(), 5.0);
    EXPECT_EQ(message.points(0).volume_share(), 0.75);
    EXPECT_EQ(message.points(1).position().x(), 105.0);
    EXPECT_EQ(message.points(1).position().z(), -10.0);
    EXPECT_EQ(message.points(1).weight(), 125.0);
    EXPECT_EQ(message.scale(), 10.0);
    EXPECT_EQ(message.volume(), 600.0);
    EXPECT_EQ(message.encoded(), encodeSignature(signature));
    EXPECT_FALSE(message.has_attributes());
}

TEST(Signatures, AttributesAreSharesByName) {
    ShapeAttributes attributes;
    attributes.quality = 255;
    for (std::size_t i = 0; i < kStatisticBins; ++i) attributes.statistics[i] = i % 16;
    Signature signature;
    signature.points.resize(1);
    signature.attributes = attributes;
    pb::Signature message;
    toProto(signature, &message);
    ASSERT_TRUE(message.has_attributes());
    EXPECT_EQ(message.attributes().quality(), 1.0);
    ASSERT_EQ(static_cast<std::size_t>(message.attributes().statistics_size()), kStatistics.size());
    std::size_t bin = 0;
    for (std::size_t s = 0; s < kStatistics.size(); ++s) {
        const pb::ShapeStatistic& statistic = message.attributes().statistics(static_cast<int>(s));
        EXPECT_EQ(statistic.name(), kStatistics[s].name);
        EXPECT_EQ(statistic.of_interior(), kStatistics[s].evidence == Evidence::kInside);
        for (const float share : statistic.shares()) {
            const double root = static_cast<double>(bin++ % 16) / 15.0;
            EXPECT_NEAR(share, root * root / 2.0, 1e-6);
        }
    }
    EXPECT_EQ(bin, kStatisticBins);
}

TEST(Explanations, KeepTheirTerms) {
    Explanation explanation;
    explanation.terms = {{"chords", 0.5, 0.25}, {"parts", 1.5, 0.75}};
    pb::Explanation message;
    toProto(explanation, &message);
    ASSERT_EQ(message.terms_size(), 2);
    EXPECT_EQ(message.terms(1).name(), "parts");
    EXPECT_EQ(message.terms(1).distance(), 1.5);
    EXPECT_EQ(message.terms(1).weight(), 0.75);
}

}  // namespace
}  // namespace shapedb::rpc
