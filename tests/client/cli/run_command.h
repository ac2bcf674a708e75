// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the real `shapedb` as a user would.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/geometry/point.h"

namespace shapedb::cli {

struct CommandRun {
    int exitCode = -1;  ///< -1: ended by a signal
    std::string out;
    std::string err;

    /// `out` as one JSON document; fails the test if it is none.
    [[nodiscard]] nlohmann::json json() const;
};

/// Runs to the end. `environment` replaces the SHAPEDB_ variables of this process.
[[nodiscard]] CommandRun runCommand(const std::vector<std::string>& arguments,
                                    const std::map<std::string, std::string>& environment = {});

/// Starts it with its output discarded; returns the process, which the caller waits for.
[[nodiscard]] int startCommand(const std::vector<std::string>& arguments);

/// Gives each test a temporary folder.
class CommandTest : public ::testing::Test {
  protected:
    CommandTest();
    ~CommandTest() override;

    [[nodiscard]] const std::string& folder() const { return folder_; }
    [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
    /// Creates folders in `name` as needed. Returns the path.
    std::string write(const std::string& name, const std::string& bytes) const;
    /// An XYZ file of the points.
    std::string writePoints(const std::string& name, const PointCloud& points) const;

  private:
    std::string folder_;
};

/// About `count` points, evenly on two unit balls at x = -1.4 and x = 1.4 joined by a rod.
[[nodiscard]] PointCloud dumbbellPoints(std::size_t count = 3000);
/// Evenly on an ellipsoid with these half axes.
[[nodiscard]] PointCloud ellipsoidPoints(double a, double b, double c, std::size_t count = 1500);

}  // namespace shapedb::cli
