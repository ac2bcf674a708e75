// The real `shapedb`, run as a user runs it.
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

    /// `out` as the one JSON document it must be; fails the test when it is not.
    [[nodiscard]] nlohmann::json json() const;
};

/// Runs to the end. `environment` replaces the SHAPEDB_ variables of this process.
[[nodiscard]] CommandRun runCommand(const std::vector<std::string>& arguments,
                                    const std::map<std::string, std::string>& environment = {});

/// Starts it with its output going nowhere; the caller waits for the process.
[[nodiscard]] int startCommand(const std::vector<std::string>& arguments);

/// A folder of its own for each test, removed at the end.
class CommandTest : public ::testing::Test {
  protected:
    CommandTest();
    ~CommandTest() override;

    [[nodiscard]] const std::string& folder() const { return folder_; }
    [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
    /// Folders in `name` are created. Returns the path.
    std::string write(const std::string& name, const std::string& bytes) const;
    /// An XYZ file of the points.
    std::string writePoints(const std::string& name, const PointCloud& points) const;

  private:
    std::string folder_;
};

/// About `count` points evenly over two unit balls at x = -1.4 and x = 1.4 that touch a rod.
[[nodiscard]] PointCloud dumbbellPoints(std::size_t count = 3000);
/// Evenly over an ellipsoid with these half axes.
[[nodiscard]] PointCloud ellipsoidPoints(double a, double b, double c, std::size_t count = 1500);

}  // namespace shapedb::cli
