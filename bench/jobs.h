// Small fixed jobs whose instructions are counted: enough of each costly part of the program that a
// change for the worse shows, and no more.
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
    /// Everything that is not to be counted; returns what is. The same in each run.
    std::function<Result<std::function<Result<void>()>>(const JobFolder& folder)> prepare;
};

/// Names and work are compared between versions: change a job's work under a new name only.
[[nodiscard]] const std::vector<Job>& jobs();

/// Writes the input that takes long to make. Errors: kFileNotWritable, those of SignatureGenerator.
[[nodiscard]] Result<void> prepareJobs(const JobFolder& folder, unsigned threads);

/// The function inside which callgrind counts (--toggle-collect): runs `work`, on one thread.
constexpr const char* kCountedFunction = "shapedb_bench_counted";
[[nodiscard]] Result<void> runCounted(const std::function<Result<void>()>& work);

}  // namespace shapedb::bench
