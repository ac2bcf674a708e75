// SPDX-License-Identifier: GPL-3.0-or-later
// One content in all the ways that programs write it: every reader must see the same points and triangles, or
// say why not. Each test goes through the formats.
#include <cctype>
#include <functional>
#include <string>

#include "tests/client/io/test_files.h"

namespace shapedb {
namespace {

using Variants = FileTest;

// Made of lines, unlike JSON.
bool isText(const SampleFile& file) {
    return file.bytes.find('\0') == std::string::npos && file.name != "scene.gltf";
}

// What is packed or described in JSON has other rules of where it ends and how it is encoded.
bool isDocument(const SampleFile& file) {
    return file.name == "scene.gltf" || file.name == "scene.glb" || file.name == "part.3mf";
}

std::vector<SampleFile> textFiles() {
    std::vector<SampleFile> files;
    for (SampleFile& file : sampleFiles()) {
        if (isText(file)) files.push_back(std::move(file));
    }
    return files;
}

// Without carriage returns, for changing line ends.
std::string withLineFeeds(const std::string& text) {
    std::string lines;
    for (const char c : text) {
        if (c != '\r') lines += c;
    }
    return lines;
}

std::string replaced(const std::string& text, const std::function<std::string(char, std::size_t)>& by) {
    std::string result;
    std::size_t line = 0;
    for (const char c : text) {
        result += by(c, line);
        if (c == '\n') ++line;
    }
    return result;
}

std::string withLineEnd(const std::string& text, const std::string& end) {
    return replaced(text, [&](char c, std::size_t) { return c == '\n' ? end : std::string(1, c); });
}

std::string utf16(const std::string& text, bool bigEndian, bool mark) {
    std::string result = !mark ? "" : bigEndian ? "\xFE\xFF" : "\xFF\xFE";
    for (const char c : text) {
        if (bigEndian) result += '\0';
        result += c;
        if (!bigEndian) result += '\0';
    }
    return result;
}

class ReadsAlike : public FileTest {
  protected:
    void check(const SampleFile& file, const std::string& bytes, const std::string& what) const {
        const auto scan = readVertices(file.name, bytes);
        ASSERT_TRUE(scan) << file.name << ", " << what << ": " << scan.error().message;
        const auto plain = readVertices("plain-" + file.name, file.bytes);
        ASSERT_TRUE(plain) << plain.error().message;
        EXPECT_EQ(scan->points, plain->points) << file.name << ", " << what;
        EXPECT_EQ(scan->trianglesInFile, plain->trianglesInFile) << file.name << ", " << what;
        EXPECT_EQ(scan->format, plain->format) << file.name << ", " << what;
    }

    /// The lines of the header of a binary file, up to the last before the data.
    static std::size_t headerSize(const SampleFile& file) {
        for (const char* last : {"end_header\n", "DATA binary\n", "DATA binary_compressed\n"}) {
            const std::size_t at = file.bytes.find(last);
            if (at != std::string::npos) return at + std::string(last).size();
        }
        return 0;
    }
};

TEST_F(ReadsAlike, AnyLineEndsInText) {
    for (const SampleFile& file : textFiles()) {
        const std::string text = withLineFeeds(file.bytes);
        check(file, withLineEnd(text, "\r"), "CR");
        check(file, withLineEnd(text, "\r\n"), "CR LF");
        check(file, text.substr(0, text.size() - 1), "no last line end");
        check(file, withLineEnd(text, "\r").substr(0, text.size() - 1), "no last CR");
        const auto mixed = [](char c, std::size_t line) -> std::string {
            if (c != '\n') return std::string(1, c);
            return line % 3 == 0 ? "\r" : line % 3 == 1 ? "\n" : "\r\n";
        };
        check(file, replaced(text, mixed), "mixed line ends");
        const auto oneLone = [](char c, std::size_t line) -> std::string {
            return c == '\n' && line == 9 ? "\r" : std::string(1, c);
        };
        check(file, replaced(text, oneLone), "a lone CR inside");
        check(file, text + std::string(500, '\0'), "zero bytes at the end");
        check(file, text + "\x1a", "Ctrl-Z at the end");
        check(file, withLineEnd(text, " \t \n"), "blanks before line ends");
    }
}

TEST_F(ReadsAlike, AnyLineEndsBeforeBinaryData) {
    std::size_t headers = 0;
    for (const SampleFile& file : sampleFiles()) {
        const std::size_t size = headerSize(file);
        if (size == 0 || isText(file)) continue;
        ++headers;
        const std::string header = file.bytes.substr(0, size);
        const std::string body = file.bytes.substr(size);
        check(file, withLineEnd(header, "\r") + body, "CR");
        check(file, withLineEnd(header, "\r\n") + body, "CR LF");
        check(file, withLineEnd(header, " \n") + body, "blanks before line ends");
        check(file, "\xEF\xBB\xBF" + file.bytes, "UTF-8 mark");
    }
    EXPECT_GE(headers, 6U);
}

// After lines that end in CR alone a line feed is the first byte of the data.
TEST_F(Variants, DataThatBeginsWithALineFeedIsWhole) {
    for (const std::string end : {"\r", "\n", "\r\n"}) {
        const std::string body = "\n" + std::string(11, '\1');
        const std::string ply =
            "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
            "property float z\nend_header\n";
        EXPECT_EQ(readGood("a.ply", withLineEnd(ply, end) + body).points.size(), 1U);
        const std::string pcd = "FIELDS x y z\nPOINTS 1\nDATA binary\n";
        EXPECT_EQ(readGood("a.pcd", withLineEnd(pcd, end) + body).points.size(), 1U);
    }
}

TEST_F(ReadsAlike, Utf8AndUtf16Text) {
    for (const SampleFile& file : textFiles()) {
        check(file, "\xEF\xBB\xBF" + file.bytes, "UTF-8 mark");
        for (const bool bigEndian : {false, true}) {
            check(file, utf16(file.bytes, bigEndian, true), "UTF-16 with mark");
            check(file, utf16(file.bytes, bigEndian, false), "UTF-16 without mark");
        }
    }
}

TEST_F(Variants, Utf16SaysWhatIsWrong) {
    for (const SampleFile& file : sampleFiles()) {
        if (isText(file)) {
            expectError(file.name, utf16(file.bytes, false, true) + "\n", kMalformed, {"inside a character"});
            expectError(file.name, std::string("\xFF\xFE\0\0a\0\0\0", 8), kMalformed, {"UTF-32", "UTF-8"});
        } else if (file.name.find(".ply") != std::string::npos ||
                   file.name.find(".pcd") != std::string::npos) {
            expectError(file.name, utf16(file.bytes, false, true), kMalformed, {"binary data", "UTF-16"});
        }
    }
    // A comment may hold any character, also beyond 16 bits, or half of one.
    const std::string rest = utf16("\n1 2 3\n", false, false);
    EXPECT_EQ(readGood("a.xyz", std::string("\xFF\xFE#\0\x3d\xd8\x00\xde\x3d\xd8", 10) + rest).points.size(),
              1U);
}

TEST_F(ReadsAlike, KeywordsAndNamesInAnyCase) {
    for (const SampleFile& file : textFiles()) {
        const auto changed = [&](int (*to)(int)) {
            return replaced(file.bytes,
                            [&](char c, std::size_t) { return std::string(1, static_cast<char>(to(c))); });
        };
        check(file, changed([](int c) { return std::toupper(c); }), "capitals");
        check(file, changed([](int c) { return std::tolower(c); }), "lower case");
    }
    for (const SampleFile& file : sampleFiles()) {
        const std::size_t size = headerSize(file);
        std::string bytes = file.bytes;
        for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(std::toupper(bytes[i]));
        check(file, bytes, "header in capitals");
        for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(std::tolower(bytes[i]));
        check(file, bytes, "header in lower case");
    }
}

TEST_F(Variants, LowerCaseNamesComeBeforeCapitals) {
    const PointCloud expected = {{4, 2, 3}};
    EXPECT_EQ(readGood("a.pcd", "FIELDS X y z x\nPOINTS 1\nDATA ascii\n1 2 3 4\n").points, expected);
    EXPECT_EQ(readGood("a.ply",
                       "ply\nformat ascii 1.0\nelement vertex 1\nproperty float X\nproperty float y\n"
                       "property float z\nproperty float x\nend_header\n1 2 3 4\n")
                  .points,
              expected);
    expectError("b.pcd", "FIELDS X X y z\nPOINTS 1\nDATA ascii\n1 2 3 4\n", kMalformed, {"'X'", "twice"});
}

TEST_F(Variants, MoreThanAnnouncedIsAnErrorEverywhere) {
    for (const SampleFile& file : sampleFiles()) {
        const bool counted = !isDocument(file) && file.name != "plain.xyz" && file.name != "crlf.txt" &&
                             file.name != "plain.obj" && file.name != "ascii.stl";
        if (!counted) continue;
        const std::string more =
            isText(file) ? "3 0 1 2\n" : std::string("\0\0\1\0", 4) + std::string(60, '\2');
        const auto scan = readVertices(file.name, file.bytes + more);
        ASSERT_FALSE(scan) << file.name;
        EXPECT_EQ(scan.error().code, kMalformed) << scan.error().message;
        if (isText(file)) continue;
        // Also beyond what is read at once.
        EXPECT_FALSE(readVertices(file.name, file.bytes + std::string(std::size_t{3} << 20, '\0') + "x"));
        EXPECT_TRUE(readVertices(file.name, file.bytes + std::string(4096, '\0'))) << file.name;
        EXPECT_TRUE(readVertices(file.name, file.bytes + "\r\n")) << file.name;
    }
}

TEST_F(ReadsAlike, CommentsAndBlankLinesEverywhere) {
    for (const SampleFile& file : textFiles()) {
        const bool ply = file.name.find(".ply") != std::string::npos;
        const std::string comment = ply ? "comment 1 2 3\nobj_info a\n" : "# 1 2 3\n";
        const std::string text = withLineFeeds(file.bytes);
        std::string commented;
        std::size_t from = 0;
        for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n', from)) {
            // Nothing but blanks may stand before the first line of PLY.
            if (from > 0 || !ply) commented += comment + "\n \t\n";
            commented += text.substr(from, end + 1 - from);
            from = end + 1;
        }
        check(file, commented + comment + "\n\n", "comments and blank lines");
    }
    const SampleFile xyz = {"a.xyz", "1 2 3\n4 5 6\n", 2, 0};
    for (const std::string sign : {"#", "//", ";", "%", "!"}) {
        check(xyz, sign + " c 1 2 3\n1 2 3\n" + sign + "7 8 9\n" + sign + "\n4 5 6\n" + sign, "sign " + sign);
    }
}

TEST_F(ReadsAlike, TabsAndBlanksBetweenWords) {
    for (const SampleFile& file : textFiles()) {
        check(file,
              replaced(file.bytes, [](char c, std::size_t) { return c == ' ' ? "\t" : std::string(1, c); }),
              "tabs");
        check(file,
              replaced(file.bytes, [](char c, std::size_t) { return c == ' ' ? " \t " : std::string(1, c); }),
              "many blanks");
    }
}

// Line ends are no more than blanks to OFF, PLY and STL.
TEST_F(ReadsAlike, RecordsOverSeveralLinesOrOnOne) {
    for (const SampleFile& file : textFiles()) {
        const bool off = file.name == "plain.off";
        const bool ply = file.name.find(".ply") != std::string::npos;
        const bool stl = file.name.find(".stl") != std::string::npos;
        if (!off && !ply && !stl) continue;
        SampleFile plain = file;
        // Without what is no number of the record.
        if (off) {
            plain.bytes =
                "OFF\n5 4 0\n0 0 0\n1 0 0\n0 2 0\n0.5 0.25 -4\n3 3 3.5\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
        }
        const std::string text = withLineFeeds(plain.bytes);
        const std::size_t body = ply   ? text.find("end_header\n") + 11
                                 : stl ? text.find('\n') + 1
                                       : text.find('\n') + 1;
        const std::size_t last = stl ? text.rfind("endsolid") : text.size();
        const auto inBody = [&](const std::string& blank, const std::string& lineEnd) {
            std::string changed = text.substr(0, body);
            for (std::size_t i = body; i < last; ++i) {
                changed += text[i] == ' ' ? blank : text[i] == '\n' ? lineEnd : std::string(1, text[i]);
            }
            return changed + text.substr(last);
        };
        check(plain, inBody("\n", "\n"), "one word on each line");
        check(plain, inBody(" ", " "), "all on one line");
        check(plain, inBody("\r\n\r\n", "\n"), "blank lines between words");
    }
    check({"one.stl",
           "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
           "endloop\nendfacet\nendsolid a b\n",
           3, 1},
          "solid a b facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet "
          "endsolid a b",
          "all on one line");
}

TEST_F(Variants, MissingNumbersAreFoundAlthoughRecordsMayGoOn) {
    const std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n";
    expectError("a.ply", ply + "1 2 3\n1 2\n1 2 3\n", kMalformed,
                {"line 10", "vertex 1 of 3", "begins in line 9", "'2'"});
    expectError("b.ply", ply + "1 2\n1 2\n1 2\n", kMalformed, {"vertex 0 of 3"});
    expectError("a.off", "OFF\n3 1 0\n1 2 3\n1 2\n1 2 3\n3 0 1 2\n", kMalformed, {"line 6"});
    expectError("b.off", "OFF\n3 2 0\n1 2 3\n1 2 3\n1 2 3\n3 0 1\n3 0 1 2\n", kMalformed, {"line 7"});
}

TEST_F(Variants, BackslashesContinueNothingButVerticesAndFaces) {
    const std::string v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (const std::string line : {"# in C:\\parts\\", "#\\", "mtllib C:\\tex\\", "usemtl a\\", "g a \\",
                                   "o \\", "vt 0 0 # c\\", "call a.obj \\", "unknown \\"}) {
        for (const std::string end : {"\n", "\r\n", "\r", " \n"}) {
            const Scan scan = readGood("a.obj", line + end + v + "f 1 2 3\n" + line + end + "f 1 3 2\n");
            EXPECT_EQ(scan.verticesInFile, 3U) << line;
            EXPECT_EQ(scan.trianglesInFile, 2U) << line;
        }
    }
    const Scan scan =
        readGood("b.obj", "v 0 \\\r\n 0 \\ \r\n 0\nv 1 0 0 # a\\\nv 0 1 0\nf 1 \\\n2 3 # c \\\nf 1 2 \\\n3");
    EXPECT_EQ(scan.verticesInFile, 3U);
    EXPECT_EQ(scan.trianglesInFile, 2U);
    // In no other format is a backslash anything but a letter.
    EXPECT_EQ(readGood("a.xyz", "# C:\\\n1 2 3\n// \\\n4 5 6\n").points.size(), 2U);
    EXPECT_EQ(readGood("a.off", "OFF # \\\n1 0 0\n1 2 3 # \\\n").points.size(), 1U);
    EXPECT_EQ(readGood("a.pcd", "# \\\nFIELDS x y z\nPOINTS 1\nDATA ascii\n1 2 3\n").points.size(), 1U);
    EXPECT_EQ(readGood("a.stl", "solid C:\\\nendsolid C:\\\n").points.size(), 0U);
    EXPECT_EQ(readGood("a.ply",
                       "ply\nformat ascii 1.0\ncomment \\\nelement vertex 1\nproperty float x\nproperty "
                       "float y\nproperty float z\nend_header\n1 2 3\n")
                  .points.size(),
              1U);
}

// A file of one vertex at each format, which `word` is the last number of.
std::vector<std::pair<std::string, std::string>> filesWithNumber(const std::string& word) {
    const std::string v = "1 2 " + word;
    return {{"a.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\n"
             "property double z\nend_header\n" +
                 v + "\n"},
            {"a.pcd", "FIELDS x y z\nSIZE 8 8 8\nPOINTS 1\nDATA ascii\n" + v + "\n"},
            {"a.off", "OFF\n1 0 0\n" + v + "\n"},
            {"a.obj", "v " + v + "\n"},
            {"a.stl", "solid\nfacet\nouter loop\nvertex " + v +
                          "\nvertex 1 2 3\nvertex 3 2 1\nendloop\nendfacet\n"
                          "endsolid\n"},
            {"a.xyz", v + "\n"}};
}

TEST_F(Variants, NumbersInEverySpelling) {
    for (const auto& [word, value] : std::vector<std::pair<std::string, double>>{{"1e-3", 0.001},
                                                                                 {"+1", 1},
                                                                                 {".5", 0.5},
                                                                                 {"-.5", -0.5},
                                                                                 {"1.", 1},
                                                                                 {"1D0", 1},
                                                                                 {"2.5d+01", 25},
                                                                                 {"1E+2", 100},
                                                                                 {"-0", 0}}) {
        for (const auto& [name, bytes] : filesWithNumber(word)) {
            const Scan scan = readGood(name, bytes);
            ASSERT_FALSE(scan.points.empty()) << name << " " << word;
            EXPECT_EQ(scan.points[0], (Point3{1, 2, value})) << name << " " << word;
        }
    }
    for (const std::string word :
         {"nan", "NaN", "-nan(ind)", "inf", "-Infinity", "1.#QNAN", "-1.#IND", "1.#INF"}) {
        for (const auto& [name, bytes] : filesWithNumber(word)) {
            if (name == "a.pcd") {
                EXPECT_EQ(readGood(name, bytes).skippedNonFinite, 1U) << word;
            } else {
                expectError(name, bytes, ErrorCode::kNonFiniteCoordinate, {"line "});
            }
        }
    }
    for (const std::string word : {"1,5", "0x10", "1e", "1d", "--1", "1.2.3", "1#5", "one", "1.#ABC"}) {
        for (const auto& [name, bytes] : filesWithNumber(word)) {
            const bool comma = word == "1,5";
            if (word == "1#5" && name != "a.xyz") continue;  // a comment
            expectError(name, bytes, kMalformed, {"line ", comma ? "with a point" : ""});
        }
    }
}

TEST_F(Variants, MessagesCountRightAndNeverNameLineZero) {
    for (const SampleFile& file : sampleFiles()) {
        expectError(file.name, "", kMalformed, {"the file is empty"});
        expectError(file.name, "\xEF\xBB\xBF", kMalformed, {"the file is empty"});
        expectError(file.name, "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
                    kMalformed, {"Git LFS pointer"});
        for (const std::string text :
             {" ", "\n", "\r\n\r\n", "# c\n", "<!DOCTYPE html>\n<html><body>404</body>\n", "solid", "ply\n",
              "OFF\n", "1\n1 2 3\n4 5 6\n"}) {
            const auto scan = readVertices(file.name, text + std::string(text.size() > 20 ? 100 : 0, 'x'));
            if (scan) continue;
            const std::string& message = scan.error().message;
            EXPECT_EQ(message.find("line 0"), std::string::npos) << message;
            EXPECT_EQ(message.find(" 1 points"), std::string::npos) << message;
            // Text that is no binary STL has no number of triangles.
            EXPECT_EQ(message.find("triangles"), std::string::npos) << message;
        }
    }
    const std::string ply =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n";
    for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
             {"a.ply", ply + "12345"},
             {"a.pcd", "FIELDS x y z\nPOINTS 1\nDATA binary\n12345"},
             {"b.pcd", "FIELDS x y z\nPOINTS 1\nDATA ascii\n1 2 3\n4 5 6\n"},
             {"c.pcd", "FIELDS x y z\nPOINTS 1\nDATA ascii\n"},
             {"a.off", "OFF\n1 1 0\n1 2 3\n3 0 0 1\n"},
             {"b.off", "OFF\n1 0 0\n1 2 3\n4 5 6\n"},
             {"a.obj", "v 1 2 3\nf 1 1 2\n"},
             {"a.stl", std::string(80, '\0') + Bytes().add(std::uint32_t{1}).str()},
             {"a.pts", "1\n1 2 3\n4 5 6\n"}}) {
        const auto scan = readVertices(name, bytes);
        ASSERT_FALSE(scan) << name;
        for (const std::string plural :
             {"1 points", "1 vertices", "1 triangles", "1 faces", "1 vertex records"}) {
            EXPECT_EQ((" " + scan.error().message).find(" " + plural), std::string::npos)
                << scan.error().message;
        }
    }
}

}  // namespace
}  // namespace shapedb
