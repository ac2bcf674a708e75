// SPDX-License-Identifier: Apache-2.0
// What the format readers produce, and the code they share. Private to client/io.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/io/input_file.h"
#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb::io {

using Triangle = std::array<std::uint32_t, 3>;

/// The content of a file, before the choice between vertices and surface samples.
struct ScanContent {
    PointCloud vertices;
    std::vector<Triangle> triangles;  ///< indices are below vertices.size()
    std::size_t skippedNonFinite = 0;
    std::vector<std::string> ignored;  ///< as in Scan
    std::string format;
};

/// Collects vertices, checking each.
class VertexSink {
  public:
    VertexSink(const InputFile& file, PointCloud& vertices, std::size_t maxPoints)
        : file_(&file), vertices_(&vertices), maxPoints_(maxPoints) {}

    /// False if the vertex is not finite or one too many; `refusal` then gives the error.
    bool add(const Point3& p) {
        if (!isFinite(p) || vertices_->size() >= maxPoints_) return false;
        vertices_->push_back(p);
        return true;
    }

    /// `where`: "line 7" or "byte 132".
    Error refusal(const Point3& p, const std::string& where) const;

    /// For vertices that are known to fit into the file.
    void reserve(std::uint64_t count);

  private:
    const InputFile* file_;
    PointCloud* vertices_;
    std::size_t maxPoints_;
};

/// Splits a polygon into triangles (first, previous, current) as its corners arrive.
class PolygonFan {
  public:
    explicit PolygonFan(std::vector<Triangle>& triangles) : triangles_(&triangles) {}
    void begin() { corners_ = 0; }
    void add(std::uint32_t vertex);

  private:
    std::vector<Triangle>* triangles_;
    std::uint64_t corners_ = 0;
    std::uint32_t first_ = 0;
    std::uint32_t previous_ = 0;
};

/// Splits a triangle strip as its corners arrive; `begin` also restarts it.
class TriangleStrip {
  public:
    explicit TriangleStrip(std::vector<Triangle>& triangles) : triangles_(&triangles) {}
    void begin() { corners_ = 0; }
    void add(std::uint32_t vertex);

  private:
    std::vector<Triangle>* triangles_;
    std::uint64_t corners_ = 0;
    std::array<std::uint32_t, 2> last_ = {};
};

/// Calls visit(record, index) for `count` records of `size` bytes, straight from the buffer. Stops if it
/// returns false or the file ends. Returns the number of successful visits.
template <typename Visit>
std::uint64_t visitRecords(InputFile& file, std::uint64_t count, std::uint64_t size, const Visit& visit) {
    std::uint64_t done = 0;
    while (done < count && file.fill(size)) {
        const char* record = file.data();
        const std::uint64_t whole = std::min<std::uint64_t>(count - done, file.available() / size);
        for (std::uint64_t i = 0; i < whole; ++i, ++done, record += size) {
            if (!visit(record, done)) return done;
        }
        file.consume(static_cast<std::size_t>(whole * size));
    }
    return done;
}

}  // namespace shapedb::io
