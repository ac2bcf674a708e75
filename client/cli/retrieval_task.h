// What a retrieval measurement is asked: which scans of a folder, of which classes, and which
// entries of a gallery are right for a query. Knows nothing of how scans are described or scored,
// so that every method is measured on the same task (`shapedb evaluate`, `shapedb-bench retrieval`).
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
    std::string label;  ///< its class: a folder's name, which one says the function that listed it
};

/// --classes and --except-classes: the classes that take part. Empty lists leave all in.
struct ClassFlags {
    std::vector<std::string> only;
    std::vector<std::string> except;

    [[nodiscard]] bool any() const { return !only.empty() || !except.empty(); }
};

/// `flags` must outlive the parsing.
void addClassFlags(CLI::App& command, ClassFlags& flags);

/// Every scan file under each root, in the order of the roots and, within one, of the paths;
/// labelled by the folder that holds it. Errors: those of listScanFiles.
[[nodiscard]] Result<std::vector<CollectionScan>> listCollection(const std::vector<std::string>& roots);

/// The scans of DIR/CLASS/... by path, labelled by the folder right below the root, however deep
/// the file lies in it; only those of the classes asked for.
///
/// Errors: those of listScanFiles; kInvalidArgument when a file lies in no class folder, when a
/// class asked for or against does not exist (the message lists those that do), or none is left.
[[nodiscard]] Result<std::vector<CollectionScan>> listClasses(const std::string& root,
                                                              const ClassFlags& classes = {});

/// What makes a gallery entry right for a query.
enum class Match {
    kFolder,  ///< same label, another file: a query is no answer to itself
    kStem,    ///< same file name without ending, in any folder: the same file, made noisy, has to
              ///< find the clean one
};

/// Errors: kInvalidArgument for a name that is neither "folder" nor "stem".
[[nodiscard]] Result<Match> matchFromName(const std::string& name);

/// The ranking of one query: entries by falling score (`scores[g]` of gallery entry g, no NaN), ties by
/// index, without the query's own file (kFolder) and those that are not `usable`; and the right ones,
/// usable or not, so that what could not be described counts as a miss.
[[nodiscard]] GalleryQuery rankGallery(Match match, const CollectionScan& query,
                                       const std::vector<CollectionScan>& gallery, const double* scores,
                                       const std::function<bool(std::size_t)>& usable);

/// A shape that could not be described is worth nothing, not what the order of files gives it by
/// chance: its pairs with its own class (labels[q] == labels[c], q or c failed) get the score
/// `belowAll`, so that where it is tied the right answers come last. `scores` has
/// labels.size()^2 values, `failed` one by label.
[[nodiscard]] ScoreMatrix withTiesAgainstFailures(ScoreMatrix scores, const std::vector<std::string>& labels,
                                                  const std::vector<bool>& failed, double belowAll);

}  // namespace shapedb::cli
