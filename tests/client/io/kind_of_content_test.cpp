// SPDX-License-Identifier: GPL-3.0-or-later
// Files under the ending of another format, also of formats that tests/support/file_cases/ does not have.
#include <filesystem>
#include <map>
#include <string>
#include <thread>

#include <sys/stat.h>

#include "client/io/text.h"
#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

class KindOfContent : public FileTest {};

const std::map<std::string, std::string>& namesOfKinds() {
    static const std::map<std::string, std::string> names = {
        {".ply", "a PLY file"},  {".pcd", "a PCD file"},  {".off", "an OFF file"},
        {".obj", "an OBJ file"}, {".stl", "an STL file"}, {".las", "a LAS file"},
        {".glb", "a glTF file"}, {".3mf", "a 3MF file"},  {".xyz", "text with a point on each line"}};
    return names;
}

TEST_F(KindOfContent, EveryFormatIsNamedUnderEveryOtherEnding) {
    for (const SampleFile& file : sampleFiles()) {
        const std::string ending = io::lowerCase(std::filesystem::path(file.name).extension().string());
        const std::string kind = ending == ".txt" || ending == ".pts" ? ".xyz" : ending;
        const std::string& name = namesOfKinds().at(kind == ".gltf" ? ".glb" : kind);
        for (const auto& [other, otherName] : namesOfKinds()) {
            if (name == otherName) continue;
            SCOPED_TRACE(file.name + " as " + other);
            std::string says = "this is " + name;
            says += ", not " + otherName + ": rename it to end in " + kind;
            expectError("a" + other, file.bytes, kMalformed, {says + ", or say --format " + kind.substr(1)});
        }
    }
}

TEST_F(KindOfContent, AFormatThatWasNamedIsNamedOtherwise) {
    ReadOptions options;
    options.format = "stl";
    const auto scan = readScan(write("a.ply", sampleFiles().front().bytes), options);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().message,
              path("a.ply") + ": this is a PLY file, not an STL file: say --format ply");
}

TEST_F(KindOfContent, LettersAreNoCountOfTrianglesInAPipeEither) {
    const std::string document = "%PDF-1.4 " + std::string(90, 'x') + std::string(400, '\0');
    const std::string says = "this is not an STL file: it does not begin with 'solid'";
    expectError("a.stl", document, kMalformed, {says});
    const std::string pipe = path("pipe.stl");
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    std::thread writer([&] { write("pipe.stl", document); });
    const auto scan = readScan(pipe);
    writer.join();
    ASSERT_FALSE(scan);
    EXPECT_NE(scan.error().message.find(says), std::string::npos) << scan.error().message;
}

}  // namespace
}  // namespace shapedb
