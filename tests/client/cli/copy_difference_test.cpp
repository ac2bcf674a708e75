// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/copy_difference.h"

#include <chrono>

#include <gtest/gtest.h>

namespace shapedb::cli {
namespace {

using client::Collection;

Collection collectionOf(const std::string& name, int created, std::vector<std::string> aliases = {}) {
    Collection collection;
    collection.name = name;
    collection.created = client::Timestamp(std::chrono::seconds(created));
    collection.aliases = std::move(aliases);
    return collection;
}

/// "delete-alias b", "rename a b" and so on.
std::vector<std::string> planned(const std::vector<Collection>& from, const std::vector<Collection>& to,
                                 const std::map<std::string, client::Timestamp>& madeOf = {}) {
    static const char* const kWords[] = {"delete-alias", "rename",  "delete",
                                         "create",       "rebuild", "set-alias"};
    std::vector<std::string> words;
    for (const CollectionStep& step : stepsBetween(from, to, madeOf)) {
        words.push_back(std::string(kWords[static_cast<int>(step.kind)]) + " " + step.name +
                        (step.other.empty() ? "" : " " + step.other));
        EXPECT_NE(stepText(step), "");
    }
    return words;
}

using Words = std::vector<std::string>;

TEST(CopyDifference, OfTheSameCollectionsNothingIsToBeDone) {
    const std::vector<Collection> all = {collectionOf("a", 1, {"x", "y"}), collectionOf("b", 2)};
    EXPECT_EQ(planned(all, all), Words());
    EXPECT_EQ(planned({}, {}), Words());
}

TEST(CopyDifference, CollectionsComeAndGo) {
    EXPECT_EQ(
        planned({collectionOf("a", 1), collectionOf("b", 2)}, {collectionOf("a", 1), collectionOf("c", 3)}),
        Words({"delete c", "create b"}));
    EXPECT_EQ(planned({}, {collectionOf("a", 1, {"x"})}), Words({"delete-alias x a", "delete a"}));
}

TEST(CopyDifference, ARenamedCollectionIsKnownByTheTimeOfItsCreation) {
    EXPECT_EQ(planned({collectionOf("new", 1, {"x"})}, {collectionOf("old", 1, {"x"})}),
              Words({"rename old new", "set-alias x new"}));
    // One that was made for another here has a time of its own there.
    EXPECT_EQ(planned({collectionOf("new", 1)}, {collectionOf("old", 9)}),
              Words({"delete old", "create new"}));
    EXPECT_EQ(planned({collectionOf("new", 1)}, {collectionOf("old", 9)},
                      {{"old", client::Timestamp(std::chrono::seconds(1))}}),
              Words({"rename old new"}));
}

TEST(CopyDifference, AnotherDescriptionIsThatOfANewCollection) {
    std::vector<Collection> from = {collectionOf("a", 2, {"x"})};
    from[0].description = "second";
    EXPECT_EQ(planned(from, {collectionOf("a", 1, {"x"})}), Words({"delete a", "create a", "set-alias x a"}));
}

TEST(CopyDifference, OtherParametersAreThoseOfARebuild) {
    std::vector<Collection> from = {collectionOf("a", 1)};
    std::vector<Collection> to = from;
    from[0].parameters.mergeRatio = 2.0;
    to[0].parameters.mergeRatio = 1.5;
    EXPECT_EQ(planned(from, to), Words({"rebuild a"}));
    from[0].damage = "it cannot be read";
    EXPECT_EQ(planned(from, to), Words()) << "what they are is not known";
}

TEST(CopyDifference, AliasesMove) {
    EXPECT_EQ(planned({collectionOf("a", 1, {"x", "y"}), collectionOf("b", 2)},
                      {collectionOf("a", 1, {"z"}), collectionOf("b", 2, {"x"})}),
              Words({"delete-alias z a", "set-alias x a", "set-alias y a"}));
}

client::Shape shapeOf(const std::string& key, const std::string& sha256) {
    client::Shape shape;
    shape.key = key;
    shape.sha256 = sha256;
    shape.pointCount = 4;
    shape.metadata = {{"label", "cup"}};
    shape.state = client::ShapeState::kReady;
    return shape;
}

TEST(CopyDifference, OfShapesIsTheFirstOfPointsMetadataAndState) {
    const auto of = [](const client::Shape& from, const client::Shape& to) {
        return std::string(differenceName(differenceOf({from, to})));
    };
    const client::Shape shape = shapeOf("a", "1");
    client::Shape other = shape;
    other.id = 7;
    other.version = 9;
    other.updated += std::chrono::seconds(5);
    EXPECT_EQ(of(shape, other), "") << "neither ids nor versions nor times count";
    other.state = client::ShapeState::kPending;
    EXPECT_EQ(of(shape, other), "state");
    other.metadata.clear();
    EXPECT_EQ(of(shape, other), "metadata");
    other.origin = {1.0, 0.0, 0.0};
    EXPECT_EQ(of(shape, other), "points");
    EXPECT_EQ(of(shape, shapeOf("a", "2")), "points");
    EXPECT_EQ(differenceOf({shape, {}}), ShapeDifference::kMissing);
    EXPECT_EQ(differenceOf({{}, shape}), ShapeDifference::kExtra);
    EXPECT_EQ((ShapePair{{}, shape}.key()), "a");
}

}  // namespace
}  // namespace shapedb::cli
