// Scan files in, points out: the one door through which files enter ShapeDB. Files are read by
// the client, never by the server, so a damaged file can only ever harm the one who reads it.
//
// What each format may contain and what is refused: docs/file-formats.md.
//
// Thread-safety: every function here may be called from any number of threads at once.
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

/// What becomes of a file that has triangles. A file without triangles always gives its vertices.
enum class MeshHandling {
    /// Surface samples, unless the vertices are themselves a good sample of the surface: see readScan.
    kAuto,
    /// The vertices as they are; the triangles are checked and counted, but not used.
    kVertices,
    /// Always surface samples; a file without triangles is refused (kInvalidArgument).
    kSurface,
};

struct ReadOptions {
    /// How many points are drawn from the surface of a mesh; at least 1.
    std::size_t meshSamples = 20000;
    /// Seed of the drawing: same file, count and seed give the same points on every machine.
    std::uint64_t seed = 1;
    /// More vertices in the file, or more samples asked for, than this is kPointLimitExceeded.
    /// Reading stops there, so it also bounds the memory. The default is no limit.
    std::size_t maxPoints = std::numeric_limits<std::size_t>::max();
    MeshHandling meshHandling = MeshHandling::kAuto;
};

struct Scan {
    /// All finite, in the file's units and order (vertices) or in drawing order (samples).
    /// May be empty or degenerate: judging the shape is the segmentation's task.
    PointCloud points;
    /// Points of a PCD file left out because a coordinate is NaN or infinite, which is how that
    /// format marks "nothing measured here". Always 0 for other formats, where it is an error.
    std::size_t skippedNonFinite = 0;
    /// True when `points` were drawn from the triangles.
    bool sampledFromMesh = false;
    /// Format and variant for people, e.g. "PLY binary little-endian".
    std::string format;
    /// Vertices in the file, including the skipped ones; STL: distinct corner positions.
    std::size_t verticesInFile = 0;
    /// Triangles after splitting polygons and strips, without those that name a vertex twice.
    std::size_t trianglesInFile = 0;
};

/// Reads one scan. The format follows from the file's ending (upper or lower case).
///
/// kAuto takes the vertices instead of drawing samples when they serve better:
///  - less than half of them belong to a triangle: a point cloud with a few faces; or
///  - there are at least `meshSamples` of them and nowhere fewer than samples would be: 99 % of
///    the area is in triangles whose longest edge is at most 3 * sqrt(area / meshSamples), three
///    times the mean spacing of that many samples. This is a scan's reconstruction, whose
///    vertices are the measured resolution; a CAD model with large flat faces fails the test; or
///  - the triangles have no area.
///
/// Progress is reported as stage "read" in bytes of the file.
///
/// Errors, each naming the file:
///  - kFileNotReadable: missing, a folder, no permission, or the device fails while reading
///  - kUnknownFileFormat: the ending is not one of scanFileEndings(); the message lists them
///  - kMalformedFile: with the line (text) or byte and element (binary) and what was expected
///  - kNonFiniteCoordinate: NaN or infinity in a file that is not PCD, with the vertex
///  - kPointLimitExceeded: see ReadOptions::maxPoints
///  - kInvalidArgument: meshSamples is 0, or kSurface and the file has no triangles
///  - kCancelled, kDeadlineExceeded: from `context`
///  - kOutOfMemory
[[nodiscard]] Result<Scan> readScan(const std::string& path, const ReadOptions& options = {},
                                    const RunContext& context = {});

/// The endings readScan knows, lower case with the dot, e.g. ".ply".
[[nodiscard]] const std::vector<std::string>& scanFileEndings();

/// One file found by listScanFiles.
struct ScanFile {
    std::string path;
    /// Name of the folder that holds the file: "Hand" for "scans/Hand/193.ply", and the current
    /// folder's name for a bare "193.ply".
    std::string label;
};

/// Turns files and folders into a list of scan files sorted by path, each once. Folders are
/// searched to any depth for the known endings; entries starting with a dot are passed over,
/// links to folders are not followed, and a .txt file counts only if its first line of content
/// looks like a point, so that a README.txt beside the scans does no harm.
///
/// Errors: kFileNotReadable when a path does not exist, a folder cannot be searched or holds no
/// scan file at all; kUnknownFileFormat when a file given by name has an unknown ending.
[[nodiscard]] Result<std::vector<ScanFile>> listScanFiles(const std::vector<std::string>& paths);

}  // namespace shapedb
