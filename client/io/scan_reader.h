// SPDX-License-Identifier: Apache-2.0
// Reads scan files. Only the client reads files, never the server, so a damaged file cannot harm others.
// docs/file-formats.md says what each format may contain and what is refused.
//
// Thread-safety: all functions may be called from any number of threads at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

/// How to read a file with triangles. A file without triangles always gives its vertices.
enum class MeshHandling {
    /// Surface samples, unless the vertices are a good sample of the surface themselves (see readScan).
    kAuto,
    /// The vertices; triangles are checked and counted, but not used.
    kVertices,
    /// Always surface samples; a file without triangles is refused (kInvalidArgument).
    kSurface,
};

struct ReadOptions {
    /// Points to sample from the surface of a mesh; at least 1.
    std::size_t meshSamples = 20000;
    /// The same file, count and seed give the same points on every machine.
    std::uint64_t seed = 1;
    /// More vertices or samples than this are kPointLimitExceeded. Reading stops there, which bounds the
    /// memory.
    std::size_t maxPoints = std::numeric_limits<std::size_t>::max();
    MeshHandling meshHandling = MeshHandling::kAuto;
    /// The format, in place of the one that the file's ending names: an ending, with or without its dot.
    /// Empty: that of the file. Standard input has no ending and needs it.
    std::string format;
};

struct Scan {
    /// All finite, in the file's units; vertices in the file's order. May be empty or degenerate: the
    /// segmentation checks that.
    PointCloud points;
    /// Points of a PCD file skipped because a coordinate is NaN or infinite, which in that format means
    /// "nothing measured here". An error in other formats.
    std::size_t skippedNonFinite = 0;
    /// What may have been faces, but was not read as such, for people: "list members of element groups" of a
    /// PLY file.
    std::vector<std::string> ignored;
    /// True if `points` were sampled from the triangles.
    bool sampledFromMesh = false;
    /// Format and variant for people, e.g. "PLY binary little-endian".
    std::string format;
    /// Including the skipped ones; STL: distinct corner positions.
    std::size_t verticesInFile = 0;
    /// After splitting polygons and strips, without those that use a vertex twice.
    std::size_t trianglesInFile = 0;
};

/// Reads one scan. The format follows from the file's ending, in upper or lower case. `path` "-" is standard
/// input (a file of that name is "./-"). A file packed by gzip is unpacked on the way; its name may end in
/// .gz after the ending of its format.
///
/// kAuto takes the vertices in place of samples if
///  - less than half of them belong to a triangle: a point cloud with a few faces; or
///  - there are at least `meshSamples` of them, and nowhere fewer than samples would be: 99 % of the area is
///  in
///    triangles whose longest edge is at most 3 * sqrt(area / meshSamples), three times the mean spacing of
///    the samples. That is a reconstructed scan, whose vertices are what was measured. A CAD model with large
///    flat faces fails the test; or
///  - the triangles have no area.
///
/// Reports progress as stage "read", in bytes of the file.
///
/// Errors, each naming the file:
///  - kFileNotReadable: missing, a folder, no permission, or a device error
///  - kUnknownFileFormat: the ending is not in scanFileEndings(); the message lists them
///  - kMalformedFile: with the line (text) or byte and element (binary), and what was expected; also gzip
///  data
///    that is damaged, or unpacks to absurdly much
///  - kNonFiniteCoordinate: NaN or infinity, except in PCD, with the vertex
///  - kCoordinateOutOfRange: the vertices were rounded to single precision so far from the origin that their
///    shape is lost (checkNotRounded)
///  - kPointLimitExceeded: see ReadOptions::maxPoints
///  - kInvalidArgument: meshSamples is 0, format is none, standard input without one, or kSurface for a file
///    without triangles
///  - kCancelled, kDeadlineExceeded: from `context`
///  - kOutOfMemory
[[nodiscard]] Result<Scan> readScan(const std::string& path, const ReadOptions& options = {},
                                    const RunContext& context = {});

/// In lower case with the dot, e.g. ".ply".
[[nodiscard]] const std::vector<std::string>& scanFileEndings();

/// The formats for people: "PLY, PCD, ... or XYZ".
[[nodiscard]] std::string scanFormatList();

struct ScanFile {
    std::string path;
    /// Name of the file's folder: "Hand" for "scans/Hand/193.ply", the current folder for "193.ply".
    std::string label;
    /// Its folder has another scan file of the same name with another ending.
    bool sharesName = false;
};

/// The scan files among files and folders, sorted by path, each once. Folders are searched to any depth for
/// the known endings. Hidden entries are skipped, links to folders are not followed, and a .txt or .csv file
/// counts only if its first line of content looks like a point, so that a README.txt does no harm.
///
/// A known ending may have .gz after it. `anyEnding`: for files that are given by name, any will do.
///
/// Errors: kFileNotReadable (a path does not exist, a folder cannot be searched or has no scan file);
/// kUnknownFileFormat (a given file has an unknown ending).
[[nodiscard]] Result<std::vector<ScanFile>> listScanFiles(const std::vector<std::string>& paths,
                                                          bool anyEnding = false);

/// "Hand/193.ply" and "Hand/193.ply.gz" -> "Hand/193".
[[nodiscard]] std::string withoutScanEnding(const std::string& name);

}  // namespace shapedb
