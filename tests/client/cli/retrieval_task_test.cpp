// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/retrieval_task.h"

#include <filesystem>

#include <gmock/gmock.h>

#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RetrievalTaskTest : public CommandTest {
  protected:
    void SetUp() override {
        const PointCloud points = ellipsoidPoints(1.0, 0.9, 0.8, 20);
        for (const char* name :
             {"set/bell/1.xyz", "set/bell/old/2.xyz", "set/cup/1.xyz", "set/round/7.xyz"}) {
            writePoints(name, points);
        }
    }

    std::vector<std::string> namesOf(const ClassFlags& classes) const {
        const auto scans = listClasses(path("set"), classes);
        EXPECT_TRUE(scans) << scans.error().message;
        std::vector<std::string> names;
        if (scans) {
            for (const CollectionScan& scan : *scans) names.push_back(scan.name);
        }
        return names;
    }

    std::string refusalOf(const ClassFlags& classes) const {
        const auto scans = listClasses(path("set"), classes);
        EXPECT_FALSE(scans);
        if (scans) return {};
        EXPECT_EQ(scans.error().code, ErrorCode::kInvalidArgument);
        return scans.error().message;
    }
};

TEST_F(RetrievalTaskTest, CollectionLabelsAreTheFoldersOfTheFiles) {
    const auto scans = listCollection({path("set")});
    ASSERT_TRUE(scans);
    ASSERT_EQ(scans->size(), 4u);
    EXPECT_EQ((*scans)[0].name, "bell/1.xyz");
    EXPECT_EQ((*scans)[0].label, "bell");
    EXPECT_EQ((*scans)[1].label, "old");
    EXPECT_EQ((*scans)[3].name, "round/7.xyz");
    EXPECT_FALSE(listCollection({path("nowhere")}));
}

TEST_F(RetrievalTaskTest, ClassIsTheFolderBelowTheRoot) {
    const auto scans = listClasses(path("set"));
    ASSERT_TRUE(scans);
    EXPECT_EQ((*scans)[1].name, "bell/old/2.xyz");
    EXPECT_EQ((*scans)[1].label, "bell");
    writePoints("set/stray.xyz", ellipsoidPoints(1.0, 1.0, 1.0, 20));
    EXPECT_THAT(refusalOf({}), HasSubstr("stray.xyz"));
}

TEST_F(RetrievalTaskTest, OnlyChosenClassesTakePart) {
    EXPECT_THAT(namesOf({{"round", "bell"}, {}}), ElementsAre("bell/1.xyz", "bell/old/2.xyz", "round/7.xyz"));
    EXPECT_THAT(namesOf({{}, {"bell"}}), ElementsAre("cup/1.xyz", "round/7.xyz"));
    EXPECT_THAT(namesOf({{"bell", "cup"}, {"bell"}}), ElementsAre("cup/1.xyz"));
}

TEST_F(RetrievalTaskTest, ClassesAndTheirComplementMakeTheWhole) {
    const auto half = namesOf({{"cup"}, {}});
    auto both = namesOf({{}, {"cup"}});
    both.insert(both.end(), half.begin(), half.end());
    EXPECT_THAT(both, ::testing::UnorderedElementsAreArray(namesOf({})));
}

TEST_F(RetrievalTaskTest, RefusesAnUnknownClassAndListsTheClasses) {
    EXPECT_THAT(refusalOf({{"bel"}, {}}),
                ::testing::AllOf(HasSubstr("'bel'"), HasSubstr("bell, cup, round")));
    EXPECT_THAT(refusalOf({{}, {"Cup"}}), HasSubstr("'Cup'"));
    EXPECT_THAT(refusalOf({{"cup"}, {"cup"}}), HasSubstr("leave no class"));
}

TEST_F(RetrievalTaskTest, MatchByFolderExcludesTheQueryItself) {
    const auto scans = listCollection({path("set")});
    ASSERT_TRUE(scans);
    const std::vector<double> scores = {1.0, 0.5, 0.2, 0.9};
    const auto all = [](std::size_t) { return true; };
    const GalleryQuery byFolder = rankGallery(Match::kFolder, (*scans)[0], *scans, scores.data(), all);
    EXPECT_THAT(byFolder.ranking, ElementsAre(3, 1, 2));
    EXPECT_TRUE(byFolder.right.empty()) << "the other bell lies in another folder";
    const GalleryQuery byStem = rankGallery(Match::kStem, (*scans)[0], *scans, scores.data(), all);
    EXPECT_THAT(byStem.ranking, ElementsAre(0, 3, 1, 2));
    EXPECT_THAT(byStem.right, ElementsAre(0, 2)) << "the files named 1";
}

TEST_F(RetrievalTaskTest, UnusableEntriesAreNotRankedButStillRight) {
    const auto scans = listCollection({path("set")});
    ASSERT_TRUE(scans);
    const std::vector<double> scores = {0.5, 0.5, 0.5, 0.5};
    const GalleryQuery query =
        rankGallery(Match::kStem, (*scans)[0], *scans, scores.data(), [](std::size_t g) { return g != 0; });
    EXPECT_THAT(query.ranking, ElementsAre(1, 2, 3)) << "ties by index";
    EXPECT_THAT(query.right, ElementsAre(0, 2));
}

TEST_F(RetrievalTaskTest, WithoutAGalleryTheClassesOfOneFolderTakePart) {
    TaskFlags flags;
    flags.paths = {path("set")};
    const auto task = retrievalTask(flags);
    ASSERT_TRUE(task);
    EXPECT_EQ(task->queries.size(), listClasses(path("set"))->size());
    EXPECT_TRUE(task->gallery.empty());
    flags.paths.push_back(path("set"));
    EXPECT_EQ(retrievalTask(flags).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(RetrievalTaskTest, WithAGalleryQueriesAndEntriesAreListedApart) {
    TaskFlags flags;
    flags.paths = {path("set")};
    flags.gallery = {path("set"), path("set")};
    EXPECT_EQ(retrievalTask(flags)->match, Match::kFolder);
    flags.match = "stem";
    const auto task = retrievalTask(flags);
    ASSERT_TRUE(task);
    EXPECT_EQ(task->match, Match::kStem);
    EXPECT_EQ(task->gallery.size(), 2 * task->queries.size());
    flags.match = "colour";
    EXPECT_EQ(retrievalTask(flags).error().code, ErrorCode::kInvalidArgument);
    flags.match = "stem";
    flags.classes.only = {"bell"};
    EXPECT_THAT(retrievalTask(flags).error().message, HasSubstr("--gallery"));
}

TEST(TiesAgainstFailures, LowersOnlySameClassPairsWithAFailure) {
    const std::vector<std::string> labels = {"a", "a", "b"};
    const ScoreMatrix scores(9, 0.0);
    const ScoreMatrix moved = withTiesAgainstFailures(scores, labels, {false, true, false}, -2.0);
    EXPECT_THAT(moved, ElementsAre(0.0, -2.0, 0.0,   //
                                   -2.0, -2.0, 0.0,  //
                                   0.0, 0.0, 0.0));
    EXPECT_EQ(withTiesAgainstFailures(scores, labels, {false, false, false}, -2.0), scores);
}

}  // namespace
}  // namespace shapedb::cli
