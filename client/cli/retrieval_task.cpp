// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/retrieval_task.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include <CLI/CLI.hpp>

#include "client/cli/scan_source.h"
#include "client/io/scan_reader.h"
#include "core/base/return_if_error.h"

namespace shapedb::cli {

namespace fs = std::filesystem;

namespace {

bool sameFile(const CollectionScan& a, const CollectionScan& b) {
    std::error_code error;
    return fs::equivalent(a.path, b.path, error) && !error;
}

bool isRight(Match match, const CollectionScan& query, const CollectionScan& entry) {
    switch (match) {
        case Match::kStem: return fs::path(query.path).stem() == fs::path(entry.path).stem();
        case Match::kFolder: break;
    }
    return query.label == entry.label && !sameFile(query, entry);
}

std::string listed(const std::set<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

/// A misspelt class would silently measure something else.
Result<void> checkClasses(const std::vector<std::string>& asked, const std::set<std::string>& known) {
    for (const std::string& name : asked) {
        if (known.count(name) == 0) {
            return fail(ErrorCode::kInvalidArgument,
                        "there is no class '" + name + "'; the classes are " + listed(known));
        }
    }
    return {};
}

Result<void> keepClasses(std::vector<CollectionScan>& scans, const ClassFlags& classes) {
    std::set<std::string> known;
    for (const CollectionScan& scan : scans) known.insert(scan.label);
    for (const auto* asked : {&classes.only, &classes.except}) {
        RETURN_IF_ERROR(checkClasses(*asked, known));
    }
    const auto holds = [](const std::vector<std::string>& names, const std::string& name) {
        return std::find(names.begin(), names.end(), name) != names.end();
    };
    scans.erase(std::remove_if(scans.begin(), scans.end(),
                               [&](const CollectionScan& scan) {
                                   const bool in = classes.only.empty() || holds(classes.only, scan.label);
                                   return !in || holds(classes.except, scan.label);
                               }),
                scans.end());
    if (scans.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "--classes and --except-classes leave no class; the classes are " + listed(known));
    }
    return {};
}

Result<Match> matchFromName(const std::string& name) {
    if (name == "folder") return Match::kFolder;
    if (name == "stem") return Match::kStem;
    return fail(ErrorCode::kInvalidArgument, "unknown --match '" + name + "'; use folder or stem");
}

}  // namespace

Result<std::vector<CollectionScan>> listCollection(const std::vector<std::string>& roots) {
    std::vector<CollectionScan> scans;
    for (const std::string& root : roots) {
        const auto files = listScanFiles({root});
        RETURN_IF_ERROR(files);
        for (const ScanFile& file : *files) {
            scans.push_back({file.path, relativeName(file.path, root), file.label});
        }
    }
    return scans;
}

Result<std::vector<CollectionScan>> listClasses(const std::string& root, const ClassFlags& classes) {
    auto scans = listCollection({root});
    RETURN_IF_ERROR(scans);
    for (CollectionScan& scan : *scans) {
        const std::size_t slash = scan.name.find('/');
        if (slash == std::string::npos) {
            return fail(ErrorCode::kInvalidArgument, scan.path + " is not in a class folder; " + root +
                                                         " must have one folder per class (DIR/CLASS/FILE)");
        }
        scan.label = scan.name.substr(0, slash);
    }
    RETURN_IF_ERROR(keepClasses(*scans, classes));
    return scans;
}

void addTaskFlags(CLI::App& command, TaskFlags& flags) {
    command
        .add_option("DIR", flags.paths,
                    "Folder of class folders; with --gallery, the queries (files or folders)")
        ->required();
    command.add_option("--gallery", flags.gallery, "Rank the queries against these files or folders")
        ->type_name("DIR");
    command
        .add_option("--match", flags.match,
                    "With --gallery: right answers have the same folder name, or the same file name")
        ->check(CLI::IsMember({"folder", "stem"}))
        ->capture_default_str();
    command
        .add_option("--classes", flags.classes.only, "Measure only these classes, as queries and candidates")
        ->delimiter(',')
        ->type_name("A,B,...");
    command.add_option("--except-classes", flags.classes.except, "Measure all classes but these")
        ->delimiter(',')
        ->type_name("A,B,...");
}

Result<RetrievalTask> retrievalTask(const TaskFlags& flags) {
    RetrievalTask task;
    if (flags.gallery.empty()) {
        if (flags.paths.size() != 1) {
            return fail(ErrorCode::kInvalidArgument,
                        "leave-one-out takes one folder of class folders; use --gallery to rank queries "
                        "against other shapes");
        }
        auto scans = listClasses(flags.paths.front(), flags.classes);
        RETURN_IF_ERROR(scans);
        task.queries = std::move(*scans);
        return task;
    }
    if (flags.classes.any()) {
        return fail(
            ErrorCode::kInvalidArgument,
            "--classes and --except-classes do not work with --gallery; give the folders that take part");
    }
    const auto match = matchFromName(flags.match);
    RETURN_IF_ERROR(match);
    task.match = *match;
    auto queries = listCollection(flags.paths);
    RETURN_IF_ERROR(queries);
    auto gallery = listCollection(flags.gallery);
    RETURN_IF_ERROR(gallery);
    task.queries = std::move(*queries);
    task.gallery = std::move(*gallery);
    return task;
}

GalleryQuery rankGallery(Match match, const CollectionScan& query, const std::vector<CollectionScan>& gallery,
                         const double* scores, const std::function<bool(std::size_t)>& usable) {
    GalleryQuery out;
    for (std::size_t g = 0; g < gallery.size(); ++g) {
        if (isRight(match, query, gallery[g])) out.right.push_back(g);
        const bool itself = match == Match::kFolder && sameFile(query, gallery[g]);
        if (usable(g) && !itself) out.ranking.push_back(g);
    }
    std::stable_sort(out.ranking.begin(), out.ranking.end(),
                     [&](std::size_t a, std::size_t b) { return scores[a] > scores[b]; });
    return out;
}

ScoreMatrix withTiesAgainstFailures(ScoreMatrix scores, const std::vector<std::string>& labels,
                                    const std::vector<bool>& failed, double belowAll) {
    const std::size_t n = labels.size();
    for (std::size_t q = 0; q < n; ++q) {
        for (std::size_t c = 0; c < n; ++c) {
            if ((failed[q] || failed[c]) && labels[q] == labels[c]) scores[q * n + c] = belowAll;
        }
    }
    return scores;
}

}  // namespace shapedb::cli
