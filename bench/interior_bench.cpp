// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench interior`: compares the interior and size of damaged scans with those of the clean scan.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/operations.h"
#include "bench/output.h"
#include "client/cli/console.h"
#include "client/cli/retrieval_task.h"
#include "client/io/scan_reader.h"
#include "core/base/math.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/geometry/bounding.h"
#include "core/geometry/box.h"
#include "core/geometry/motion.h"
#include "core/pipeline.h"
#include "core/segmentation/segmentation.h"
#include "core/synthetic/degrade.h"

namespace shapedb::bench {

namespace {

constexpr std::uint64_t kSeed = 1;
constexpr double kOutlierShare = 0.01;
constexpr double kKeptShare = 0.8;

enum class Damage { kNoise, kOutliers, kCap };

struct Condition {
    const char* name;
    Damage damage;
    double noise;  // share of the box diagonal
};

constexpr std::array<Condition, 7> kConditions = {{
    {"clean", Damage::kNoise, 0.0},
    {"0.25 %", Damage::kNoise, 0.0025},
    {"0.5 %", Damage::kNoise, 0.005},
    {"1 %", Damage::kNoise, 0.01},
    {"2 %", Damage::kNoise, 0.02},
    {"1 % outliers", Damage::kOutliers, 0.0},
    {"cap missing", Damage::kCap, 0.0},
}};

// Adds points uniform in the cloud's box: kOutlierShare of its number.
void addOutliers(PointCloud& points) {
    const auto [low, high] = boxOf(points);
    Random random(kSeed);
    const auto count = static_cast<std::size_t>(kOutlierShare * static_cast<double>(points.size()));
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back(
            {random.uniform(low.x, high.x), random.uniform(low.y, high.y), random.uniform(low.z, high.z)});
    }
}

Point3 capDirection() {
    Random random(kSeed);
    return randomDirection(random);
}

// Cuts off the part farthest in a direction.
void cutCap(PointCloud& points) {
    const Point3 direction = capDirection();
    std::sort(points.begin(), points.end(),
              [&](const Point3& a, const Point3& b) { return dot(a, direction) < dot(b, direction); });
    points.resize(static_cast<std::size_t>(kKeptShare * static_cast<double>(points.size())));
}

Result<PointCloud> damaged(PointCloud points, const Condition& condition) {
    switch (condition.damage) {
        case Damage::kNoise: {
            RETURN_IF_ERROR(addGaussianNoise(points, condition.noise, kSeed));
            break;
        }
        case Damage::kOutliers: addOutliers(points); break;
        case Damage::kCap: cutCap(points); break;
    }
    return points;
}

// Of one shape, or the sum over a class.
struct Figures {
    double volumeError = 0.0;  // |volume / true volume - 1|, at most 1
    double worst = 0.0;
    double sizeError = 0.0;
    double quality = 0.0;
    double seconds = 0.0;
    std::size_t shapes = 0;
    std::size_t failed = 0;

    void add(const Figures& other) {
        volumeError += other.volumeError;
        worst = std::max(worst, other.worst);
        sizeError += other.sizeError;
        quality += other.quality;
        seconds += other.seconds;
        shapes += other.shapes;
        failed += other.failed;
    }
    double mean(double sum) const { return shapes == 0 ? 0.0 : sum / static_cast<double>(shapes); }
};

using Row = std::array<Figures, kConditions.size()>;

// Volume of the interior up to the last point that cutting the cap left.
double volumeBelow(const Segmentation& whole, const PointCloud& left) {
    const Point3 direction = capDirection();
    const double height = dot(left.back(), direction);
    double sum = 0.0;
    for (std::size_t t = 0; t < whole.tetrahedra.size(); ++t) {
        if (whole.tetrahedronSegment[t] < 0) continue;
        const auto& v = whole.tetrahedra.vertices[t];
        const Point3& a = whole.sites[v[0]];
        const Point3& b = whole.sites[v[1]];
        const Point3& c = whole.sites[v[2]];
        const Point3& d = whole.sites[v[3]];
        if (0.25 * dot(a + b + c + d, direction) > height) continue;
        sum += dot(b - a, cross(c - a, d - a)) / 6.0;
    }
    return sum;
}

// The reference is the interior that the published method finds in the clean scan (below the cut, if a cap is
// missing) and the box of the remaining points.
Result<Row> measure(const PointCloud& clean, const RunContext& context) {
    SegmentationOptions published = parametersOf(Profile::kPaper).segmentation;
    const auto truth = segment(clean, published, context);
    RETURN_IF_ERROR(truth);
    const auto wholeSize = smallestBoxDiagonal(clean);
    RETURN_IF_ERROR(wholeSize);
    Row row;
    for (std::size_t i = 0; i < kConditions.size(); ++i) {
        const auto points = damaged(clean, kConditions[i]);
        RETURN_IF_ERROR(points);
        double volume = truth->volume;
        double size = *wholeSize;
        if (kConditions[i].damage == Damage::kCap) {
            volume = volumeBelow(*truth, *points);
            size = smallestBoxDiagonal(*points).value_or(size);
        }
        Figures& figures = row[i];
        figures.shapes = 1;
        const auto found = segment(*points, parametersOf(Profile::kDefault).segmentation, context);
        if (!found && found.error().code == ErrorCode::kCancelled) return fail(found.error());
        if (!found) {
            figures = {1.0, 1.0, 1.0, 0.0, 0.0, 1, 1};
            continue;
        }
        figures.volumeError = std::min(1.0, std::abs(found->volume / volume - 1.0));
        figures.worst = figures.volumeError;
        figures.sizeError = std::abs(found->size / size - 1.0);
        figures.quality = found->quality;
        figures.seconds = found->totalSeconds;
    }
    return row;
}

std::string line(const std::string& name, const Row& row) {
    std::string text = "| " + name + " |";
    for (const Figures& f : row) {
        text += " " + numberText("%.1f", 100.0 * f.mean(f.volumeError)) + " / " +
                numberText("%.1f", 100.0 * f.worst) + " |";
    }
    return text + "\n";
}

template <typename Value>
std::string summary(const std::string& name, const Row& all, const char* format, Value value) {
    std::string text = "| " + name + " |";
    for (const Figures& f : all) text += " " + numberText(format, value(f)) + " |";
    return text + "\n";
}

std::string header() {
    std::string text = "| class |";
    std::string rule = "|---|";
    for (const Condition& condition : kConditions) {
        text += " " + std::string(condition.name) + " |";
        rule += "---|";
    }
    return text + "\n" + rule + "\n";
}

Result<int> runInterior(const std::string& folder, std::size_t perClass, Bench& bench) {
    const auto scans = cli::listClasses(folder, {});
    RETURN_IF_ERROR(scans);
    std::map<std::string, Row> classes;
    std::map<std::string, std::size_t> taken;
    Row all;
    for (const auto& scan : *scans) {
        if (perClass != 0 && taken[scan.label] == perClass) continue;
        ++taken[scan.label];
        const auto read = readScan(scan.path);
        RETURN_IF_ERROR(read);
        const auto row = measure(read->points, bench.context());
        RETURN_IF_ERROR(row);
        for (std::size_t i = 0; i < row->size(); ++i) {
            classes[scan.label][i].add((*row)[i]);
            all[i].add((*row)[i]);
        }
        bench.console.note(scan.path);
    }
    std::string text = describe(environment()) + "\n\n" + header();
    for (const auto& [name, row] : classes) text += line(name, row);
    text += line("all: mean / worst volume error, %", all);
    text += summary("size error, mean %", all, "%.2f",
                    [](const Figures& f) { return 100.0 * f.mean(f.sizeError); });
    text += summary("quality, mean", all, "%.2f", [](const Figures& f) { return f.mean(f.quality); });
    text += summary("seconds, mean", all, "%.2f", [](const Figures& f) { return f.mean(f.seconds); });
    text +=
        summary("no interior", all, "%.0f", [](const Figures& f) { return static_cast<double>(f.failed); });
    bench.console.text(text);
    return cli::kOk;
}

}  // namespace

void addInteriorOperation(CLI::App& app, Bench& bench) {
    struct Flags {
        std::string folder;
        std::size_t perClass = 0;
    };
    auto flags = std::make_shared<Flags>();
    CLI::App* command = app.add_subcommand(
        "interior", "Error of the interior's volume and of the size under noise, outliers and a missing cap");
    command->add_option("folder", flags->folder, "Folder of class folders with clean, closed scans")
        ->required();
    command->add_option("--per-class", flags->perClass, "Shapes of each class to take (0: all)");
    command->callback([flags, &bench] {
        bench.action = [flags, &bench] { return runInterior(flags->folder, flags->perClass, bench); };
    });
}

}  // namespace shapedb::bench
