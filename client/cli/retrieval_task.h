// SPDX-License-Identifier: GPL-3.0-or-later
// The task of a retrieval measurement: which scans of a folder, of which classes, and which entries of a
// gallery are right for a query. Independent of how scans are described and scored, so that every method is
// measured on the same task (`shapedb evaluate`, `shapedb-bench retrieval`).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/evaluation/metrics.h"

namespace CLI {
class App;
}

namespace shapedb::cli {

/// One scan file of a collection.
struct CollectionScan {
    std::string path;   ///< as found
    std::string name;   ///< relative to the folder it was found in; decides its seed
    std::string label;  ///< its class: the name of a folder, depending on the function that listed it
};

/// --classes and --except-classes: which classes take part. Empty lists: all.
struct ClassFlags {
    std::vector<std::string> only;
    std::vector<std::string> except;

    [[nodiscard]] bool any() const { return !only.empty() || !except.empty(); }
};

/// All scan files under the roots, by root and path, labelled by the folder that holds them. Errors: those
/// of listScanFiles.
[[nodiscard]] Result<std::vector<CollectionScan>> listCollection(const std::vector<std::string>& roots);

/// The scans of ROOT/CLASS/... at any depth, by path, labelled by the folder right below the root; only
/// those of the selected classes.
///
/// Errors: those of listScanFiles; kInvalidArgument when a file is not in a class folder, a class of the
/// flags does not exist (the message lists those that do), or none is left.
[[nodiscard]] Result<std::vector<CollectionScan>> listClasses(const std::string& root,
                                                              const ClassFlags& classes = {});

/// What makes a gallery entry right for a query.
enum class Match {
    kFolder,  ///< same label, another file: a query does not count as its own answer
    kStem,    ///< same file name without extension, in any folder: a noisy copy has to find the clean file
};

/// What to measure: DIR..., --gallery, --match, --classes and --except-classes.
struct TaskFlags {
    std::vector<std::string> paths;
    std::vector<std::string> gallery;
    std::string match = "folder";
    ClassFlags classes;
};

/// `flags` must outlive the parsing.
void addTaskFlags(CLI::App& command, TaskFlags& flags);

struct RetrievalTask {
    std::vector<CollectionScan> queries;
    /// Empty: leave-one-out, each query against all other queries, right when the label is the same.
    std::vector<CollectionScan> gallery;
    Match match = Match::kFolder;  ///< with a gallery
};

/// The scans that `flags` name. Errors: those of listClasses and listCollection; kInvalidArgument (several
/// folders or an unknown --match; classes with a gallery).
[[nodiscard]] Result<RetrievalTask> retrievalTask(const TaskFlags& flags);

/// The ranking of one query: entries in descending order of score (`scores[g]` of gallery entry g, no NaN),
/// ties by index, without the query's own file (kFolder) and without unusable entries. The right ones include
/// unusable ones, so that a shape that could not be described counts as a miss.
[[nodiscard]] GalleryQuery rankGallery(Match match, const CollectionScan& query,
                                       const std::vector<CollectionScan>& gallery, const double* scores,
                                       const std::function<bool(std::size_t)>& usable);

/// A shape that could not be described must not gain from the order of the files: its pairs with its own
/// class (labels[q] == labels[c], q or c failed) get the score `belowAll`, so that the right answers come
/// last among ties. `scores` has labels.size()^2 values, `failed` one per label.
[[nodiscard]] ScoreMatrix withTiesAgainstFailures(ScoreMatrix scores, const std::vector<std::string>& labels,
                                                  const std::vector<bool>& failed, double belowAll);

}  // namespace shapedb::cli
