// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/client/cli/run_command.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include "common/child_process.h"

namespace shapedb::cli {

namespace fs = std::filesystem;

namespace {

ChildProcess start(const std::vector<std::string>& arguments,
                   const std::map<std::string, std::string>& environment, const std::string& outFile,
                   const std::string& errFile) {
    const auto create = [](const std::string& file) {
        return ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    };
    const int out = create(outFile);
    const int err = create(errFile);
    auto process = ChildProcess::start(SHAPEDB_PATH, arguments, environment, out, err);
    ::close(out);
    ::close(err);
    return std::move(process).value();
}

std::string slurp(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::string makeFolder() {
    std::string pattern = (fs::temp_directory_path() / "shapedb-cli-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) ADD_FAILURE() << "cannot create " << pattern;
    return pattern;
}

/// Directions of a Fibonacci spiral: evenly over the unit sphere.
Point3 direction(std::size_t i, std::size_t count) {
    const double z = 1.0 - 2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double angle = 2.399963229728653 * static_cast<double>(i);
    const double radius = std::sqrt(1.0 - z * z);
    return {radius * std::cos(angle), radius * std::sin(angle), z};
}

}  // namespace

nlohmann::json CommandRun::json() const {
    auto document = nlohmann::json::parse(out, nullptr, false);
    EXPECT_FALSE(document.is_discarded()) << "standard output is not one JSON document:\n" << out << err;
    return document;
}

CommandRun runCommand(const std::vector<std::string>& arguments,
                      const std::map<std::string, std::string>& environment) {
    const std::string folder = makeFolder();
    CommandRun run;
    run.exitCode = start(arguments, environment, folder + "/out", folder + "/err").wait();
    run.out = slurp(folder + "/out");
    run.err = slurp(folder + "/err");
    fs::remove_all(folder);
    return run;
}

int startCommand(const std::vector<std::string>& arguments) {
    return start(arguments, {}, "/dev/null", "/dev/null").release();
}

CommandTest::CommandTest() : folder_(makeFolder()) {}
CommandTest::~CommandTest() { fs::remove_all(folder_); }

std::string CommandTest::write(const std::string& name, const std::string& bytes) const {
    const fs::path file(path(name));
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << bytes;
    return file.string();
}

std::string CommandTest::writePoints(const std::string& name, const PointCloud& points) const {
    std::string text;
    char line[120];
    for (const Point3& p : points) {
        std::snprintf(line, sizeof line, "%.9g %.9g %.9g\n", p.x, p.y, p.z);
        text += line;
    }
    return write(name, text);
}

PointCloud dumbbellPoints(std::size_t count) {
    PointCloud points;
    const std::size_t ball = count * 45 / 100;
    for (std::size_t i = 0; i < ball; ++i) {
        const Point3 d = direction(i, ball);
        if (d.x < 0.95) points.push_back({d.x - 1.4, d.y, d.z});
        if (d.x > -0.95) points.push_back({d.x + 1.4, d.y, d.z});
    }
    const std::size_t rod = count - 2 * ball;
    for (std::size_t i = 0; i < rod; ++i) {
        const double angle = 2.399963229728653 * static_cast<double>(i);
        const double along = static_cast<double>(i) / static_cast<double>(rod);
        points.push_back({-0.45 + 0.9 * along, 0.3 * std::cos(angle), 0.3 * std::sin(angle)});
    }
    return points;
}

PointCloud ellipsoidPoints(double a, double b, double c, std::size_t count) {
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        const Point3 d = direction(i, count);
        points.push_back({a * d.x, b * d.y, c * d.z});
    }
    return points;
}

}  // namespace shapedb::cli
