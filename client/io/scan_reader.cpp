// SPDX-License-Identifier: Apache-2.0
#include "client/io/scan_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "client/io/formats.h"
#include "client/io/input_file.h"
#include "client/io/kind_of_content.h"
#include "client/io/scan_content.h"
#include "client/io/text.h"
#include "core/base/return_if_error.h"
#include "core/geometry/mesh.h"
#include "core/geometry/resolution.h"

namespace shapedb {

namespace fs = std::filesystem;

namespace {

using io::InputFile;
using io::ScanContent;
using io::Triangle;

using ReadFormat = Result<ScanContent> (*)(InputFile&, std::size_t);

struct Format {
    const char* ending;
    ReadFormat read;
};

constexpr std::array<Format, 16> kFormats = {{{".ply", io::readPly},
                                              {".pcd", io::readPcd},
                                              {".off", io::readOff},
                                              {".obj", io::readObj},
                                              {".stl", io::readStl},
                                              {".las", io::readLas},
                                              {".gltf", io::readGltf},
                                              {".glb", io::readGltf},
                                              {".3mf", io::read3mf},
                                              {".xyz", io::readXyz},
                                              {".xyzn", io::readXyz},
                                              {".xyzrgb", io::readXyz},
                                              {".txt", io::readXyz},
                                              {".pts", io::readXyz},
                                              {".asc", io::readXyz},
                                              {".csv", io::readXyz}}};

// Share of the area that must be in small triangles, and how small: see readScan.
constexpr double kDenseAreaShare = 0.99;
constexpr double kDenseEdge = 3.0;

constexpr const char* kPacked = ".gz";

/// Of the format, in lower case: ".ply" of "scan.PLY" and of "scan.ply.gz".
std::string endingOf(const fs::path& path) {
    const std::string ending = io::lowerCase(path.extension().string());
    return ending == kPacked ? io::lowerCase(path.stem().extension().string()) : ending;
}

const Format* formatWithEnding(const std::string& ending) {
    const auto* format = std::find_if(kFormats.begin(), kFormats.end(),
                                      [&](const Format& candidate) { return ending == candidate.ending; });
    return format == kFormats.end() ? nullptr : format;
}

const Format* formatOf(const std::string& path) { return formatWithEnding(endingOf(path)); }

std::string endingList() {
    std::string list;
    for (const Format& format : kFormats) list += (list.empty() ? "" : " ") + std::string(format.ending);
    return list;
}

/// Endings of one reader are neighbours in kFormats, the first of them names the format.
std::vector<std::string> formatNames() {
    std::vector<std::string> names;
    ReadFormat last = nullptr;
    for (const Format& format : kFormats) {
        if (format.read != last) names.push_back(io::upperCase(format.ending + 1));
        last = format.read;
    }
    return names;
}

Error unknownFormat(const std::string& path) {
    const std::string ending = endingOf(path);
    const std::string advice = io::conversionAdvice(ending);
    return {ErrorCode::kUnknownFileFormat,
            path + ": " +
                (ending.empty() ? "no file ending" : "unknown file ending " + io::inQuotes(ending)) +
                (advice.empty() ? "" : ": " + advice) + "; scan files end in " + endingList() +
                ", and .gz after that if they are packed"};
}

Result<const Format*> chooseFormat(const std::string& path, const std::string& given) {
    if (!given.empty()) {
        const Format* format = formatWithEnding((given[0] == '.' ? "" : ".") + io::lowerCase(given));
        if (format != nullptr) return format;
        return fail(ErrorCode::kInvalidArgument,
                    "there is no format " + io::inQuotes(given) + "; there are " + endingList());
    }
    if (path == "-") {
        return fail(
            ErrorCode::kInvalidArgument,
            "standard input: has no file extension; give its format (--format), one of " + endingList());
    }
    if (const Format* format = formatOf(path)) return format;
    return fail(unknownFormat(path));
}

bool mostVerticesAreLoose(const ScanContent& content) {
    std::vector<bool> used(content.vertices.size());
    std::size_t count = 0;
    for (const Triangle& triangle : content.triangles) {
        for (const std::uint32_t v : triangle) {
            if (!used[v]) ++count;
            used[v] = true;
        }
    }
    return count < content.vertices.size() - count;
}

bool verticesServeBetter(const ScanContent& content, std::size_t samples) {
    if (mostVerticesAreLoose(content)) return true;
    struct Size {
        double area;
        double squaredEdge;
    };
    const auto measure = [&](const Triangle& t) {
        const Point3& a = content.vertices[t[0]];
        const Point3& b = content.vertices[t[1]];
        const Point3& c = content.vertices[t[2]];
        return Size{0.5 * length(cross(b - a, c - a)),
                    std::max({squaredDistance(a, b), squaredDistance(b, c), squaredDistance(c, a)})};
    };
    double area = 0.0;
    for (const Triangle& t : content.triangles) area += measure(t).area;
    // Coordinates too large or too small for an area: the segmentation refuses them.
    if (!(area > 0.0) || !std::isfinite(area)) return true;
    if (content.vertices.size() < samples) return false;
    const double greatest = kDenseEdge * kDenseEdge * area / static_cast<double>(samples);
    double denseArea = 0.0;
    for (const Triangle& t : content.triangles) {
        const Size size = measure(t);
        if (size.squaredEdge <= greatest) denseArea += size.area;
    }
    return denseArea >= kDenseAreaShare * area;
}

bool wantsSamples(const ScanContent& content, const ReadOptions& options) {
    if (options.meshHandling == MeshHandling::kSurface) return true;
    if (options.meshHandling == MeshHandling::kVertices || content.triangles.empty()) return false;
    return !verticesServeBetter(content, options.meshSamples);
}

Result<PointCloud> samplePoints(const std::string& path, ScanContent&& content, const ReadOptions& options) {
    if (content.triangles.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    path + ": the file has no triangles to sample; read its vertices");
    }
    if (options.meshSamples > options.maxPoints) {
        return fail(ErrorCode::kPointLimitExceeded, path + ": " + std::to_string(options.meshSamples) +
                                                        " surface samples are above the limit of " +
                                                        std::to_string(options.maxPoints) + " points");
    }
    const TriangleMesh mesh = {std::move(content.vertices), std::move(content.triangles)};
    auto points = sampleSurface(mesh, options.meshSamples, options.seed);
    if (!points) return fail(withContext(points.error(), path + ": "));
    return points;
}

struct Archive {
    std::string_view start;
    const char* name;
};
constexpr std::array<Archive, 5> kArchives = {{{"PK\x03\x04", "ZIP archive"},
                                               {"BZh", "file packed by bzip2"},
                                               {"\xfd"
                                                "7zXZ",
                                                "file packed by xz"},
                                               {"\x28\xb5\x2f\xfd", "file packed by zstd"},
                                               {"7z\xbc\xaf\x27\x1c", "7-Zip archive"}}};

/// What no reader can make anything of is named for what it is.
Result<void> checkHasContent(InputFile& file, const Format& format) {
    constexpr std::string_view kPointer = "version https://git-lfs.github.com/spec/";
    const std::string_view start = file.peek(kPointer.size());
    const bool onlyMark = start == "\xEF\xBB\xBF" || start == "\xFF\xFE" || start == "\xFE\xFF";
    if (onlyMark || (start.empty() && !file.failure())) return fail(file.malformed("the file is empty"));
    if (start == kPointer) {
        return fail(
            file.malformed("this is a Git LFS pointer, not the file itself; fetch that with 'git lfs pull'"));
    }
    if (format.read == io::read3mf) return {};  // a ZIP archive
    for (const Archive& archive : kArchives) {
        if (start.substr(0, archive.start.size()) != archive.start) continue;
        return fail(file.malformed(std::string("this is a ") + archive.name + "; unpack it first"));
    }
    return {};
}

// What to say in place of a reader's complaint about a file that is not what its ending or its header says.
std::optional<Error> ofAnotherKind(const InputFile& file, const Format& format, const ReadOptions& options,
                                   std::string_view start, std::optional<std::uint64_t> size) {
    const std::string ending(io::endingOfContent(start, size));
    const Format* found = formatWithEnding(ending);
    if (found == nullptr) return std::nullopt;
    if (found->read == format.read) {
        if (!io::hasTextForBinary(start)) return std::nullopt;
        return file.malformed("the header announces binary data, but text follows: it should say 'ascii'");
    }
    const auto* expected = std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& candidate) {
        return candidate.read == format.read;
    });
    const bool named = !options.format.empty() || file.isStandardInput();
    return file.malformed("this is " + std::string(io::kindName(ending)) + ", not " +
                          std::string(io::kindName(expected->ending)) + ": " +
                          (named ? "" : "rename it to end in " + ending + ", or ") + "say --format " +
                          ending.substr(1));
}

Result<ScanContent> readContent(InputFile& file, const Format& format, const ReadOptions& options) {
    const std::string start(file.peek(io::kKindBytes));
    const auto size = file.remaining();
    const auto usable = checkHasContent(file, format);
    auto content = usable ? format.read(file, options.maxPoints) : fail(usable.error());
    // The real reason comes before the parser's complaint about an early end.
    if (file.failure()) return fail(*file.failure());
    if (content) return content;
    const bool refused = content.error().code == ErrorCode::kMalformedFile ||
                         content.error().code == ErrorCode::kNonFiniteCoordinate;
    if (auto error = refused ? ofAnotherKind(file, format, options, start, size) : std::nullopt) {
        return fail(std::move(*error));
    }
    return content;
}

Result<Scan> readScanUnguarded(const std::string& path, const ReadOptions& options,
                               const RunContext& context) {
    if (options.meshSamples == 0) {
        return fail(ErrorCode::kInvalidArgument, "the number of surface samples must be at least 1");
    }
    if (path == "-") RETURN_IF_ERROR(chooseFormat(path, options.format));
    auto file = InputFile::open(path, context);
    RETURN_IF_ERROR(file);
    const auto format = chooseFormat(path, options.format);
    RETURN_IF_ERROR(format);
    auto content = readContent(*file, **format, options);
    RETURN_IF_ERROR(content);
    // The vertices: samples of their triangles have digits that tell nothing.
    const auto intact = checkNotRounded(content->vertices);
    if (!intact) return fail(withContext(intact.error(), path + ": "));

    Scan scan;
    scan.skippedNonFinite = content->skippedNonFinite;
    scan.ignored = std::move(content->ignored);
    scan.format = content->format;
    scan.verticesInFile = content->vertices.size() + content->skippedNonFinite;
    scan.trianglesInFile = content->triangles.size();
    scan.sampledFromMesh = wantsSamples(*content, options);
    if (!scan.sampledFromMesh) {
        scan.points = std::move(content->vertices);
        return scan;
    }
    auto points = samplePoints(path, std::move(*content), options);
    RETURN_IF_ERROR(points);
    scan.points = std::move(*points);
    return scan;
}

Error notSearchable(const std::string& path, const std::string& why) {
    return {ErrorCode::kFileNotReadable, path + ": " + why};
}

// Text and tables may be about anything.
bool isScanFile(const std::string& path) {
    if (formatOf(path) == nullptr) return false;
    if (endingOf(path) != ".txt" && endingOf(path) != ".csv") return true;
    const RunContext context;
    auto file = InputFile::open(path, context);
    return file && io::looksLikeXyz(*file);
}

Result<void> searchFolder(const std::string& folder, std::vector<std::string>& found) {
    std::error_code error;
    const std::size_t before = found.size();
    auto entry = fs::recursive_directory_iterator(folder, error);
    for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
        const fs::path& path = entry->path();
        if (path.filename().string()[0] == '.') {
            entry.disable_recursion_pending();
            continue;
        }
        std::error_code statusError;  // a link to nothing is not a scan
        if (entry->is_regular_file(statusError) && isScanFile(path.string())) found.push_back(path.string());
    }
    if (error) return fail(notSearchable(folder, "cannot be searched: " + error.message()));
    if (found.size() == before) {
        return fail(notSearchable(folder, "no scan file in this folder; scan files end in " + endingList()));
    }
    return {};
}

// The scan files of a folder by their names without endings.
using NamesOfFolder = std::map<std::string, std::vector<std::string>>;

NamesOfFolder namesOfFolder(const fs::path& folder) {
    NamesOfFolder names;
    std::error_code error;
    for (auto entry = fs::directory_iterator(folder, error); !error && entry != fs::directory_iterator();
         entry.increment(error)) {
        const std::string file = entry->path().filename().string();
        std::error_code statusError;
        if (file[0] == '.' || formatOf(file) == nullptr || !entry->is_regular_file(statusError)) continue;
        names[withoutScanEnding(file)].push_back(entry->path().string());
    }
    return names;
}

// Whether the folder of each file has another scan of its name.
void markSharedNames(std::vector<ScanFile>& files) {
    std::map<fs::path, NamesOfFolder> folders;
    for (ScanFile& file : files) {
        const fs::path path(file.path);
        const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
        auto known = folders.find(folder);
        if (known == folders.end()) known = folders.emplace(folder, namesOfFolder(folder)).first;
        const auto alike = known->second.find(withoutScanEnding(path.filename().string()));
        if (alike == known->second.end()) continue;
        file.sharesName =
            std::any_of(alike->second.begin(), alike->second.end(), [&](const std::string& other) {
                return fs::path(other).filename() != path.filename() && isScanFile(other);
            });
    }
}

Result<std::vector<ScanFile>> listScanFilesUnguarded(const std::vector<std::string>& paths, bool anyEnding) {
    std::vector<std::string> found;
    for (const std::string& path : paths) {
        std::error_code error;
        const fs::file_status status = fs::status(path, error);
        if (!fs::exists(status)) {
            return fail(notSearchable(
                path,
                "cannot be read: " + (error ? error.message() : std::string("no such file or folder"))));
        }
        if (fs::is_directory(status)) {
            RETURN_IF_ERROR(searchFolder(path, found));
        } else if (!anyEnding && formatOf(path) == nullptr) {
            return fail(unknownFormat(path));
        } else {
            found.push_back(path);
        }
    }
    // "./a.ply" and "a.ply" are one file.
    for (std::string& path : found) path = fs::path(path).lexically_normal().string();
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    std::vector<ScanFile> files;
    files.reserve(found.size());
    for (std::string& path : found) {
        std::string label = fs::absolute(path).lexically_normal().parent_path().filename().string();
        files.push_back({std::move(path), std::move(label)});
    }
    markSharedNames(files);
    return files;
}

}  // namespace

Result<Scan> readScan(const std::string& path, const ReadOptions& options, const RunContext& context) {
    try {
        return readScanUnguarded(path, options, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, path + ": not enough memory to read the file");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, path + ": reading failed: " + e.what());
    }
}

const std::vector<std::string>& scanFileEndings() {
    static const std::vector<std::string> endings = [] {
        std::vector<std::string> all;
        for (const Format& format : kFormats) all.emplace_back(format.ending);
        return all;
    }();
    return endings;
}

std::string scanFormatList() {
    const std::vector<std::string> names = formatNames();
    std::string list;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (i > 0) list += i + 1 == names.size() ? " or " : ", ";
        list += names[i];
    }
    return list;
}

Result<std::vector<ScanFile>> listScanFiles(const std::vector<std::string>& paths, bool anyEnding) {
    try {
        return listScanFilesUnguarded(paths, anyEnding);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to list the scan files");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kFileNotReadable, std::string("cannot list the scan files: ") + e.what());
    }
}

std::string withoutScanEnding(const std::string& name) {
    const fs::path path(name);
    const bool packed = io::lowerCase(path.extension().string()) == kPacked;
    return (path.parent_path() / (packed ? path.stem().stem() : path.stem())).generic_string();
}

}  // namespace shapedb
