// The task of a retrieval measurement: which scans of which classes take part, and which gallery entries are
// right for a query. Independent of how scans are described and scored, so that every method gets the same
// task
// (`shapedb evaluate`, `shapedb-bench retrieval`).
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
    std::string name;   ///< relative to the folder that was searched; decides its seed
    std::string label;  ///< its class: the name of a folder, see the function that listed it
};

/// --classes and --except-classes: the classes that take part. Empty lists: all of them.
struct ClassFlags {
    std::vector<std::string> only;
    std::vector<std::string> except;

    [[nodiscard]] bool any() const { return !only.empty() || !except.empty(); }
};

/// `flags` must outlive the parsing.
void addClassFlags(CLI::App& command, ClassFlags& flags);

/// All scan files under the roots, by root and then by path, labelled by the folder they are in.
/// Errors: those of listScanFiles.
[[nodiscard]] Result<std::vector<CollectionScan>> listCollection(const std::vector<std::string>& roots);

/// The scans of DIR/CLASS/... by path, at any depth, labelled by the folder right below the root; only those
/// of the chosen classes.
///
/// Errors: those of listScanFiles; kInvalidArgument if a file is in no class folder, a class does not exist
/// (the message lists those that do), or no class is left.
[[nodiscard]] Result<std::vector<CollectionScan>> listClasses(const std::string& root,
                                                              const ClassFlags& classes = {});

/// What makes a gallery entry right for a query.
enum class Match {
    kFolder,  ///< same label, but another file
    kStem,    ///< same file name without ending, in any folder: a noisy copy must find the clean file
};

/// Errors: kInvalidArgument for a name that is neither "folder" nor "stem".
[[nodiscard]] Result<Match> matchFromName(const std::string& name);

/// The ranking of one query: `usable` entries by falling score (`scores[g]` of gallery entry g, no NaN), ties
/// by index, without the query's own file (kFolder); and the right entries, usable or not, so that one that
/// could not be described counts as a miss.
[[nodiscard]] GalleryQuery rankGallery(Match match, const CollectionScan& query,
                                       const std::vector<CollectionScan>& gallery, const double* scores,
                                       const std::function<bool(std::size_t)>& usable);

/// Lets no shape that could not be described profit from the order of files in a tie: its pairs with its own
/// class (labels[q] == labels[c], q or c failed) get the score `belowAll`, so that right answers come last.
/// `scores` has labels.size()^2 values, `failed` one per label.
[[nodiscard]] ScoreMatrix withTiesAgainstFailures(ScoreMatrix scores, const std::vector<std::string>& labels,
                                                  const std::vector<bool>& failed, double belowAll);

}  // namespace shapedb::cli
