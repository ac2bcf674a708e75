// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb sample`: labelled noisy scans of made-up shapes, as test and demo data.
#include <algorithm>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>

#include "client/cli/checks.h"
#include "client/cli/console.h"
#include "client/cli/scan_source.h"
#include "client/cli/session.h"
#include "client/cli/text.h"
#include "client/io/ply_writer.h"
#include "core/base/return_if_error.h"
#include "core/synthetic/families.h"

namespace shapedb::cli {

namespace fs = std::filesystem;

namespace {

struct SampleFlags {
    std::string folder;
    std::vector<std::string> families;
    std::size_t count = 10;
    std::size_t first = 1;
    std::size_t points = 20000;
    double noise = 0.002;
    std::uint64_t seed = 1;
    bool upright = false;
    bool list = false;
};

struct SampleFile {
    std::string family;
    std::size_t number = 0;  ///< from 1
    std::string path;
};

/// "animal/animal_01.ply": names sort by number up to 99.
std::string sampleName(const std::string& family, std::size_t number) {
    std::string digits = std::to_string(number);
    if (digits.size() < 2) digits.insert(0, 1, '0');
    return family + "/" + family + "_" + digits + ".ply";
}

CommandResult listFamilyNames(Session& session) {
    nlohmann::json list = nlohmann::json::array();
    Table table({{"family"}, {"description"}});
    for (const FamilyInfo& family : listFamilies()) {
        list.push_back({{"family", family.name}, {"description", family.description}});
        table.add({family.name, family.description});
    }
    session.console().document({{"families", list}});
    session.console().text(table.render());
    return kOk;
}

Result<std::vector<std::string>> chosenFamilies(const std::vector<std::string>& asked) {
    std::vector<std::string> known;
    for (const FamilyInfo& family : listFamilies()) known.push_back(family.name);
    if (asked.empty()) return known;
    for (const std::string& name : asked) {
        if (std::find(known.begin(), known.end(), name) == known.end()) {
            return fail(ErrorCode::kInvalidArgument,
                        "there is no family '" + name + "'; 'shapedb sample --list' lists them");
        }
    }
    std::vector<std::string> chosen = asked;
    std::sort(chosen.begin(), chosen.end());
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    return chosen;
}

Result<void> writeSample(const SampleFlags& flags, const SampleFile& file) {
    const auto solid = makeMember(file.family, file.number - 1, flags.seed);
    RETURN_IF_ERROR(solid);
    ScanOptions options;
    options.count = flags.points;
    options.noise = flags.noise;
    options.seed = fileSeed(flags.seed, sampleName(file.family, file.number));
    options.randomPose = !flags.upright;
    const auto scan = scanOf(*solid, options);
    if (!scan) return fail(withContext(scan.error(), file.path + ": "));
    return writePointsPly(file.path, *scan);
}

Result<void> writeAll(Session& session, const SampleFlags& flags, const std::vector<SampleFile>& files) {
    const RunContext context = session.context();
    std::vector<Result<void>> results(files.size());
    std::atomic<std::size_t> done{0};
    tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
        if (const auto proceed = context.checkpoint(); !proceed) {
            results[i] = fail(proceed.error());
            return;
        }
        results[i] = writeSample(flags, files[i]);
        session.console().progress("sample", ++done, files.size());
    });
    for (const Result<void>& result : results) {
        RETURN_IF_ERROR(result);
    }
    return {};
}

CommandResult runSample(Session& session, const SampleFlags& flags) {
    session.leftBehind = "the files written so far stay";
    if (flags.list) return listFamilyNames(session);
    if (flags.folder.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "give the folder to write to, or --list to see the families");
    }
    const auto families = chosenFamilies(flags.families);
    RETURN_IF_ERROR(families);

    std::vector<SampleFile> files;
    for (const std::string& family : *families) {
        const fs::path folder = fs::path(flags.folder) / family;
        std::error_code error;
        fs::create_directories(folder, error);
        if (error) {
            return fail(ErrorCode::kFileNotWritable,
                        "cannot create the folder " + folder.string() + ": " + error.message());
        }
        for (std::size_t number = flags.first; number < flags.first + flags.count; ++number) {
            files.push_back({family, number, (fs::path(flags.folder) / sampleName(family, number)).string()});
        }
    }
    RETURN_IF_ERROR(writeAll(session, flags, files));

    nlohmann::json names = nlohmann::json::array();
    for (const SampleFile& file : files) names.push_back({{"file", file.path}, {"label", file.family}});
    session.console().document({{"files", names},
                                {"families", *families},
                                {"points", flags.points},
                                {"noise", flags.noise},
                                {"seed", flags.seed}});
    session.console().text(formatCount(files.size(), "scan", "scans") + " of " +
                           formatCount(families->size(), "family", "families") + " in " +
                           inLine(flags.folder) + ", " + formatCount(flags.points) + " points each, noise " +
                           formatPercent(flags.noise) + " of the diagonal, seed " +
                           std::to_string(flags.seed) + "\n");
    return kOk;
}

}  // namespace

void addSampleCommand(CLI::App& app, Session& session) {
    auto flags = std::make_shared<SampleFlags>();
    CLI::App* command =
        app.add_subcommand("sample", "Write labelled noisy scans of made-up shapes (needs no server)");
    command->add_option("DIR", flags->folder, "Folder to write to: DIR/FAMILY/FAMILY_01.ply, ...");
    command->add_option("--families", flags->families, "Only these families, separated by commas [all]")
        ->delimiter(',')
        ->allow_extra_args(false);
    command->add_option("--count", flags->count, "Scans per family")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    command->add_option("--first", flags->first, "Number of the first scan; each number is another shape")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    command->add_option("--points", flags->points, "Points per scan")
        ->check(CLI::Range(4, 100000000))
        ->capture_default_str();
    command->add_option("--noise", flags->noise, "Gaussian noise, as a share of the bounding-box diagonal")
        ->check(noiseShare())
        ->capture_default_str();
    command->add_option("--seed", flags->seed, "Seed for shapes, poses and noise")->capture_default_str();
    command->add_flag("--upright", flags->upright, "Do not turn, scale or move the shapes");
    command->add_flag("--list", flags->list, "List the families");
    command->callback(
        [&session, flags] { session.action = [&session, flags] { return runSample(session, *flags); }; });
}

}  // namespace shapedb::cli
