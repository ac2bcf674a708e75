// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

#include <unistd.h>

#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

namespace fs = std::filesystem;

class EvaluateCommand : public CommandTest {
  protected:
    /// Three very different families of three scans.
    static void SetUpTestSuite() {
        samples() = (fs::temp_directory_path() / ("shapedb-evaluate-" + std::to_string(::getpid()))).string();
        const CommandRun run = runCommand(
            {"sample", samples(), "--count", "3", "--points", "700", "--families", "human,mug,airplane"});
        ASSERT_EQ(run.exitCode, 0) << run.err;
    }
    static void TearDownTestSuite() { fs::remove_all(samples()); }

    static std::string& samples() {
        static std::string folder;
        return folder;
    }

    static nlohmann::json evaluate(std::vector<std::string> arguments, int exitCode = 0) {
        arguments.insert(arguments.begin(), "evaluate");
        arguments.push_back("--json");
        const CommandRun run = runCommand(arguments);
        EXPECT_EQ(run.exitCode, exitCode) << run.err;
        return run.json();
    }

    /// Without values that differ from run to run.
    static nlohmann::json timeless(nlohmann::json document) {
        for (const char* key : {"seconds_segment", "seconds_match", "threads"}) document.erase(key);
        return document;
    }
};

constexpr const char* kMeasures[] = {"nn", "first_tier", "second_tier", "dcg", "map"};

TEST_F(EvaluateCommand, LeaveOneOutHasThePromisedKeys) {
    const auto document = evaluate({samples(), "--profile", "paper"});
    for (const char* key : kMeasures) {
        ASSERT_TRUE(document.contains(key)) << key;
        EXPECT_GE(document[key].get<double>(), 0.0) << key;
        EXPECT_LE(document[key].get<double>(), 1.0) << key;
    }
    EXPECT_EQ(document["queries"], 9);
    EXPECT_EQ(document["classes"], 3);
    EXPECT_GT(document["seconds_segment"].get<double>(), 0.0);
    EXPECT_GE(document["seconds_match"].get<double>(), 0.0);
    EXPECT_EQ(document["parameters"]["profile"], "paper");
    EXPECT_EQ(document["noise"], 0.0);
    EXPECT_EQ(document["seed"], 1);
    EXPECT_TRUE(document["failures"].empty());
    EXPECT_FALSE(document.contains("per_class"));
    EXPECT_GT(document["nn"].get<double>(), 0.5) << "three very different families";
}

TEST_F(EvaluateCommand, MeanIsTheMeanOfEqualClasses) {
    const auto document = evaluate({samples(), "--per-class"});
    ASSERT_EQ(document["per_class"].size(), 3u);
    for (const char* key : kMeasures) {
        double sum = 0.0;
        for (const auto& one : document["per_class"]) {
            EXPECT_EQ(one["queries"], 3);
            sum += one[key].get<double>();
        }
        EXPECT_NEAR(document[key].get<double>(), sum / 3.0, 1e-12) << key;
    }
}

TEST_F(EvaluateCommand, MeasuresOnlyChosenClasses) {
    const auto only = evaluate({samples(), "--profile", "paper", "--classes", "human,mug", "--per-class"});
    EXPECT_EQ(only["queries"], 6);
    EXPECT_EQ(only["shapes"], 6);
    EXPECT_FALSE(only["per_class"].contains("airplane"));
    EXPECT_EQ(only["only_classes"], nlohmann::json({"human", "mug"}));
    const auto except =
        evaluate({samples(), "--profile", "paper", "--except-classes", "airplane", "--per-class"});
    EXPECT_EQ(only["per_class"], except["per_class"]);
    const auto refused = evaluate({samples(), "--classes", "humans"}, 2);
    EXPECT_NE(refused["error"]["message"].get<std::string>().find("airplane, human, mug"), std::string::npos);
    evaluate({samples(), "--gallery", samples(), "--classes", "human"}, 2);
}

TEST_F(EvaluateCommand, ResultDoesNotDependOnThreads) {
    const std::vector<std::string> noisy = {samples(), "--noise", "0.005", "--points", "600", "--per-class"};
    const auto with = [&](const char* threads) {
        auto arguments = noisy;
        arguments.insert(arguments.end(), {"--threads", threads});
        return timeless(evaluate(arguments));
    };
    const auto one = with("1");
    EXPECT_EQ(one, with("4"));
    EXPECT_EQ(one["noise"], 0.005);
    EXPECT_EQ(one["points"], 600);
}

TEST_F(EvaluateCommand, NoiseOfAFileDoesNotDependOnTheOthers) {
    // The score of the same two files, with and without other queries.
    const auto scoreOf = [&](const std::vector<std::string>& queries) {
        std::vector<std::string> arguments = queries;
        arguments.insert(arguments.end(),
                         {"--gallery", samples() + "/human/human_02.ply", "--noise", "0.003"});
        const auto document = evaluate(arguments);
        for (const auto& rank : document["ranks"]) {
            if (fs::path(rank["query"].get<std::string>()).filename() == "human_01.ply") {
                return rank["best_score"].get<double>();
            }
        }
        return -1.0;
    };
    const double alone = scoreOf({samples() + "/human/human_01.ply"});
    EXPECT_GT(alone, 0.0);
    EXPECT_EQ(alone, scoreOf({samples() + "/airplane/airplane_01.ply", samples() + "/human/human_01.ply"}));
}

TEST_F(EvaluateCommand, UnsegmentableShapesCountAsMisses) {
    fs::copy(samples(), path("set"), fs::copy_options::recursive);
    PointCloud flat;
    for (int i = 0; i < 50; ++i) flat.push_back({0.1 * (i % 7), 0.1 * (i / 7), 0.0});
    // First in the order of files, which would otherwise favour it in a tie at 0.
    writePoints("set/airplane/aaa_flat.xyz", flat);
    const auto clean = evaluate({samples(), "--profile", "paper", "--per-class"});
    const auto document = evaluate({path("set"), "--profile", "paper", "--per-class"});
    EXPECT_EQ(document["queries"], 10) << "it is a query like the others";
    ASSERT_EQ(document["failures"].size(), 1u);
    EXPECT_EQ(document["failures"][0]["error"], "coplanar");
    EXPECT_NE(document["failures"][0]["file"].get<std::string>().find("aaa_flat.xyz"), std::string::npos);
    const double found = clean["per_class"]["airplane"]["nn"].get<double>() * 3.0;
    EXPECT_NEAR(document["per_class"]["airplane"]["nn"].get<double>(), found / 4.0, 1e-12);
    EXPECT_EQ(document["per_class"]["human"]["nn"], clean["per_class"]["human"]["nn"]);
}

TEST_F(EvaluateCommand, UnreadableFilesAreNamedWithExitCodeOne) {
    fs::copy(samples(), path("set"), fs::copy_options::recursive);
    write("set/mug/broken.ply", "ply\nformat ascii 1.0\nelement vertex 10\n");
    const auto document = evaluate({path("set"), "--profile", "paper"}, 1);
    EXPECT_EQ(document["queries"], 10);
    ASSERT_EQ(document["failures"].size(), 1u);
    EXPECT_EQ(document["failures"][0]["error"], "malformed_file");
}

TEST_F(EvaluateCommand, DrawsTheSimilarityMatrix) {
    const std::string png = path("matrix.png");
    const std::string svg = path("matrix.svg");
    evaluate({samples(), "--profile", "paper", "--confusion", png});
    evaluate({samples(), "--profile", "paper", "--confusion", svg});
    std::string magic(4, '\0');
    std::ifstream(png, std::ios::binary).read(magic.data(), 4);
    EXPECT_EQ(magic, "\x89PNG");
    std::string text((std::istreambuf_iterator<char>(*std::make_unique<std::ifstream>(svg))), {});
    EXPECT_NE(text.find("<svg"), std::string::npos);
    EXPECT_NE(text.find("human"), std::string::npos);
}

TEST_F(EvaluateCommand, RefusesAnUnknownFigureFormatBeforeTheWork) {
    const auto document = evaluate({samples(), "--confusion", path("matrix.bmp")}, 3);
    EXPECT_EQ(document["error"]["name"], "unknown_file_format");
}

TEST_F(EvaluateCommand, RefusesFilesOutsideClassFolders) {
    fs::copy(samples(), path("set"), fs::copy_options::recursive);
    writePoints("set/stray.xyz", dumbbellPoints(500));
    const auto document = evaluate({path("set")}, 2);
    EXPECT_NE(document["error"]["message"].get<std::string>().find("stray.xyz"), std::string::npos);
}

TEST_F(EvaluateCommand, ClassIsTheFolderBelowTheRoot) {
    fs::create_directories(path("set/people/of"));
    fs::create_directories(path("set/cups/of"));
    fs::copy(samples() + "/human", path("set/people/of/one"));
    fs::copy(samples() + "/mug", path("set/cups/of/one"));
    const auto document = evaluate({path("set"), "--profile", "paper", "--per-class"});
    ASSERT_EQ(document["per_class"].size(), 2u);
    EXPECT_EQ(document["per_class"]["people"]["queries"], 3);
}

TEST_F(EvaluateCommand, GalleryMatchesByFolder) {
    const auto document =
        evaluate({samples() + "/human/human_01.ply", "--gallery", samples() + "/human", samples() + "/mug"});
    EXPECT_EQ(document["queries"], 1);
    EXPECT_EQ(document["gallery"], 6);
    for (const char* key : {"hit_at_1", "hit_at_5", "mrr"}) ASSERT_TRUE(document.contains(key)) << key;
    ASSERT_EQ(document["ranks"].size(), 1u);
    const auto& rank = document["ranks"][0];
    EXPECT_EQ(document["mrr"].get<double>(), 1.0 / rank["rank"].get<double>());
    EXPECT_NE(rank["best"], rank["query"]) << "a query does not find itself by folder";
}

TEST_F(EvaluateCommand, GalleryByStemFindsTheCleanScanOfANoisyOne) {
    const auto document =
        evaluate({samples(), "--gallery", samples(), "--match", "stem", "--noise", "0.001"});
    EXPECT_EQ(document["queries"], 9);
    EXPECT_GT(document["hit_at_1"].get<double>(), 0.5);
    EXPECT_GE(document["hit_at_5"].get<double>(), document["hit_at_1"].get<double>());
    const auto exact = evaluate({samples(), "--profile", "paper", "--gallery", samples(), "--match", "stem"});
    EXPECT_EQ(exact["hit_at_1"], 1.0);
    EXPECT_EQ(exact["mrr"], 1.0);
    for (const auto& rank : exact["ranks"]) EXPECT_EQ(rank["right_score"], 1.0);
}

TEST_F(EvaluateCommand, GalleryReportsQueriesWithoutARightAnswer) {
    const auto document =
        evaluate({samples() + "/human", "--profile", "paper", "--gallery", samples() + "/mug"});
    EXPECT_EQ(document["queries"], 0);
    EXPECT_EQ(document["without_right_answer"], 3);
    EXPECT_EQ(document["mrr"], 0.0);
    for (const auto& rank : document["ranks"]) EXPECT_EQ(rank["rank"], 0);
}

TEST_F(EvaluateCommand, GalleryFailuresCountAsMisses) {
    PointCloud flat;
    for (int i = 0; i < 50; ++i) flat.push_back({0.1 * (i % 7), 0.1 * (i / 7), 0.0});
    writePoints("queries/human/flat.xyz", flat);
    const auto document = evaluate({path("queries"), "--profile", "paper", "--gallery", samples()});
    EXPECT_EQ(document["queries"], 1);
    EXPECT_EQ(document["hit_at_5"], 0.0);
    EXPECT_EQ(document["ranks"][0]["rank"], 0);
    EXPECT_EQ(document["failures"].size(), 1u);
}

TEST_F(EvaluateCommand, TextShowsTheMeasures) {
    const CommandRun run = runCommand({"evaluate", samples(), "--profile", "paper", "--per-class"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    for (const char* word : {"NN", "1st tier", "mAP", "human", "mug", "airplane", "9 queries"}) {
        EXPECT_NE(run.out.find(word), std::string::npos) << word << "\n" << run.out;
    }
}

}  // namespace
}  // namespace shapedb::cli
