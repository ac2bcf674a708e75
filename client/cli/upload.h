// SPDX-License-Identifier: GPL-3.0-or-later
// The scans of `shapedb add`, and the keys that they get.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/api/client.h"
#include "client/cli/scan_source.h"
#include "core/base/error.h"
#include "core/base/length_unit.h"

namespace shapedb::cli {

struct AddFlags {
    std::vector<std::string> paths;
    std::string collection;
    std::string key;
    std::string base;
    std::vector<std::string> metadata;
    bool labelFromFolder = false;
    bool insertOnly = false;
    bool updateOnly = false;
    bool replace = false;
    bool keepEnding = false;
    bool wait = false;
    bool each = false;
    unsigned jobs = 1;
    ScanFlags scan;
    std::optional<LengthUnit> unit;
};

/// A scan, or with --each an object of one. Neither `reply` nor `failure`: it was not sent.
struct Upload {
    std::string path;
    std::string name;  ///< relative to the given path; decides the seed
    std::string key;
    std::string label;
    std::optional<client::AddReply> reply;
    std::optional<Error> failure;  ///< it was not stored, or with --wait could not be segmented
};

/// The files of the paths with their keys. Of files that differ only in their ending (box.stl beside
/// box.obj), given or not, the key keeps it.
///
/// Errors: those of listScanFiles and keyOfFile; kInvalidArgument naming two files with one key, with --each
/// also if an object of one may get the key of the other.
[[nodiscard]] Result<std::vector<Upload>> listUploads(const AddFlags& flags);

/// Other points of a key that is taken are replaced with --replace alone, also with --update-only.
[[nodiscard]] client::AddRequest requestFor(const AddFlags& flags, const client::Metadata& metadata,
                                            const Upload& upload);

}  // namespace shapedb::cli
