// SPDX-License-Identifier: GPL-3.0-or-later
// The program's `run`, called as a shell calls it, and a folder of labelled scans to call it on.
#pragma once

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/geometry/point.h"

namespace shapedb::bench {

struct BenchRun {
    int exitCode = -1;
    std::string out;
    std::string err;
};

[[nodiscard]] BenchRun runBench(std::vector<std::string> arguments);

/// Evenly drawn from the surface of a box with these half sides, seeded.
[[nodiscard]] PointCloud boxPoints(double a, double b, double c, std::size_t count, std::uint64_t seed);

/// A folder of its own for each test, removed at the end. `set/` holds three scans each of cubes
/// (`cube`), plates (`plate`) and rods (`rod`), every one of another size.
class BenchTest : public ::testing::Test {
  protected:
    BenchTest();
    ~BenchTest() override;

    [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
    [[nodiscard]] std::string set() const { return path("set"); }
    /// Folders in `name` are created. Returns the path.
    std::string write(const std::string& name, const std::string& bytes) const;
    std::string writePoints(const std::string& name, const PointCloud& points) const;
    [[nodiscard]] std::string read(const std::string& name) const;

  private:
    std::string folder_;
};

}  // namespace shapedb::bench
