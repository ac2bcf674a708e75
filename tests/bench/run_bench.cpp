// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/run_bench.h"

#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include <unistd.h>

#include "bench/operations.h"
#include "client/cli/console.h"
#include "core/base/random.h"

namespace shapedb::bench {

namespace fs = std::filesystem;

BenchRun runBench(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), kProgramName);
    std::vector<const char*> argv;
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    std::ostringstream out;
    std::ostringstream err;
    const std::atomic<bool> cancel{false};
    BenchRun result;
    {
        cli::Console console(out, err, {}, kProgramName);
        result.exitCode = run(static_cast<int>(argv.size()), argv.data(), console, cancel);
    }
    result.out = out.str();
    result.err = err.str();
    return result;
}

PointCloud boxPoints(double a, double b, double c, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    const std::array<double, 3> half = {a, b, c};
    const std::array<double, 3> faces = {b * c, a * c, a * b};
    PointCloud points;
    while (points.size() < count) {
        const double face = random.uniform(0.0, faces[0] + faces[1] + faces[2]);
        const std::size_t axis = face < faces[0] ? 0 : (face < faces[0] + faces[1] ? 1 : 2);
        std::array<double, 3> p{};
        for (std::size_t i = 0; i < 3; ++i) p[i] = half[i] * random.uniform(-1.0, 1.0);
        p[axis] = random.below(2) == 0 ? half[axis] : -half[axis];
        points.push_back({p[0], p[1], p[2]});
    }
    return points;
}

BenchTest::BenchTest() {
    static std::atomic<int> count{0};
    folder_ = (fs::temp_directory_path() /
               ("shapedb-bench-" + std::to_string(::getpid()) + "-" + std::to_string(++count)))
                  .string();
    fs::create_directories(folder_);
    for (int i = 1; i <= 3; ++i) {
        const double size = 0.5 * i;
        const auto seed = static_cast<std::uint64_t>(i);
        const std::string name = "/" + std::to_string(i) + ".xyz";
        writePoints("set/cube" + name, boxPoints(size, 1.05 * size, 0.95 * size, 900, seed));
        writePoints("set/plate" + name, boxPoints(size, size, 0.2 * size, 900, 10 + seed));
        writePoints("set/rod" + name, boxPoints(size, 0.2 * size, 0.2 * size, 900, 20 + seed));
    }
}

BenchTest::~BenchTest() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
}

std::string BenchTest::write(const std::string& name, const std::string& bytes) const {
    const fs::path file = path(name);
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << bytes;
    return file.string();
}

std::string BenchTest::writePoints(const std::string& name, const PointCloud& points) const {
    std::ostringstream text;
    text.precision(17);
    for (const Point3& p : points) text << p.x << ' ' << p.y << ' ' << p.z << '\n';
    return write(name, text.str());
}

std::string BenchTest::read(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace shapedb::bench
