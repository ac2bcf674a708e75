// SPDX-License-Identifier: Apache-2.0
// Whether lists of an unknown element of a PLY file name the corners of faces. Private to client/io.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "client/io/scan_content.h"

namespace shapedb::io {

/// Collects triangles while every list names three vertices or more, each once.
class FaceGuess {
  public:
    FaceGuess(std::string name, std::uint64_t vertexCount)
        : name_(std::move(name)),
          vertexCount_(std::min<std::uint64_t>(vertexCount, std::numeric_limits<std::uint32_t>::max())) {}

    /// For people.
    const std::string& name() const { return name_; }
    bool good() const { return good_; }

    /// Begins a list with this many entries.
    void begin(std::int64_t length) {
        corners_.clear();
        if (length < 3 || length > kMostCorners) reject();
    }
    void add(std::int64_t vertex) {
        if (!good_) return;
        const bool there = vertex >= 0 && static_cast<std::uint64_t>(vertex) < vertexCount_;
        if (!there || std::find(corners_.begin(), corners_.end(), vertex) != corners_.end()) return reject();
        corners_.push_back(vertex);
    }
    void end() {
        PolygonFan fan(triangles_);
        fan.begin();
        for (const std::int64_t corner : corners_) fan.add(static_cast<std::uint32_t>(corner));
    }

    std::vector<Triangle> takeTriangles() { return std::move(triangles_); }

  private:
    /// Longer lists are groups of points.
    static constexpr std::int64_t kMostCorners = 64;

    void reject() {
        good_ = false;
        corners_.clear();
        triangles_.clear();
    }

    std::string name_;
    std::uint64_t vertexCount_;
    bool good_ = true;
    std::vector<std::int64_t> corners_;
    std::vector<Triangle> triangles_;
};

}  // namespace shapedb::io
