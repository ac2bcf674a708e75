// SPDX-License-Identifier: GPL-3.0-or-later
// The files that all readers are held to: tests/support/file_cases/.
#include <fstream>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

nlohmann::json fileCases() { return nlohmann::json::parse(std::ifstream(SHAPEDB_FILE_CASES)); }

std::string bytesOfCase(const nlohmann::json& one) {
    return one.contains("text") ? one["text"].get<std::string>() : unBase64(one["base64"]);
}

class FileCases : public FileTest {
  protected:
    void checkRead(const nlohmann::json& one, const nlohmann::json& shape) const {
        const Scan scan = readGood(one["file"], bytesOfCase(one));
        PointCloud expected;
        for (const auto& v : shape["vertices"]) expected.push_back({v[0], v[1], v[2]});
        EXPECT_EQ(scan.points, expected);
        EXPECT_EQ(scan.trianglesInFile, shape["triangles"].size());
        EXPECT_EQ(scan.skippedNonFinite, one.value("skipped", 0U));
        std::vector<std::string> ignored;
        if (one.contains("ignored")) ignored = {one["ignored"]};
        EXPECT_EQ(scan.ignored, ignored);
    }

    void checkRefused(const nlohmann::json& one) const {
        const auto scan = readVertices(one["file"], bytesOfCase(one));
        ASSERT_FALSE(scan);
        EXPECT_EQ(errorCodeName(scan.error().code), one["refused"].get<std::string>())
            << scan.error().message;
        for (const std::string part : one["says"]) {
            EXPECT_NE(scan.error().message.find(part), std::string::npos)
                << "'" << scan.error().message << "' lacks '" << part << "'";
        }
    }
};

TEST_F(FileCases, AreReadOrRefusedAsByAllReaders) {
    const nlohmann::json document = fileCases();
    for (const auto& one : document["cases"]) {
        SCOPED_TRACE(one["name"].get<std::string>());
        if (one.contains("reads")) {
            checkRead(one, document["shapes"][one["reads"].get<std::string>()]);
        } else {
            checkRefused(one);
        }
    }
}

TEST_F(FileCases, UnknownFacesAreSampledAndWhatIsPassedOverIsTold) {
    const nlohmann::json document = fileCases();
    std::size_t checked = 0;
    for (const auto& one : document["cases"]) {
        if (one.value("reads", "") != "cube") continue;
        const auto scan = readScan(write(one["file"], bytesOfCase(one)));
        ASSERT_TRUE(scan) << scan.error().message;
        EXPECT_TRUE(scan->sampledFromMesh) << one["name"];
        ++checked;
    }
    EXPECT_GE(checked, 9U);
}

}  // namespace
}  // namespace shapedb
