// SPDX-License-Identifier: GPL-3.0-or-later
// Small fixed jobs whose instructions are counted: just enough of each costly part of the program to show a
// slowdown.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace shapedb::bench {

/// Where a job finds its input and may leave files.
struct JobFolder {
    std::string path;
    /// What `prepareJobs` writes there.
    [[nodiscard]] std::string signatures() const { return path + "/signatures"; }
};

struct Job {
    const char* name;         ///< static storage
    const char* description;  ///< one line for a person
    /// Does the work that is not counted and returns the work that is. Deterministic.
    std::function<Result<std::function<Result<void>()>>(const JobFolder& folder)> prepare;
};

/// Counts are compared between versions by name: a job with other work needs a new name.
[[nodiscard]] const std::vector<Job>& jobs();

/// Writes the inputs that are slow to make. Errors: kFileNotWritable, those of SignatureGenerator.
[[nodiscard]] Result<void> prepareJobs(const JobFolder& folder, unsigned threads);

/// callgrind counts inside this function (--toggle-collect), which runs `work` on one thread.
constexpr const char* kCountedFunction = "shapedb_bench_counted";
[[nodiscard]] Result<void> runCounted(const std::function<Result<void>()>& work);

}  // namespace shapedb::bench
