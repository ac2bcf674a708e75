// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the instruction counts of the jobs (jobs.h) with a committed file: slowdowns show even on a busy
// machine.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace shapedb::bench {

/// What else the counts depend on.
struct CountingEnvironment {
    std::string compiler;
    std::string buildType;
    std::string libc;
    std::string valgrind;
    /// Instruction sets of the processor that libraries select functions by.
    std::string processor;

    /// "compiler g++ 12.2.0, build type Release, ..."
    [[nodiscard]] std::string text() const;
};
[[nodiscard]] bool operator==(const CountingEnvironment& a, const CountingEnvironment& b);

struct Counts {
    CountingEnvironment environment;
    std::map<std::string, std::uint64_t> jobs;  ///< instructions by name
};

/// As committed: JSON. Errors: kMalformedFile.
[[nodiscard]] Result<Counts> parseCounts(const std::string& text);
[[nodiscard]] std::string countsText(const Counts& counts);

struct JobVerdict {
    enum class Kind {
        kSame,  ///< within the margin
        kLess,  ///< fewer by more than the margin: update the baseline
        kMore,  ///< more, beyond the margin
        kNew,   ///< not in the baseline
        kGone,  ///< only in the baseline
    };
    std::string name;
    Kind kind = Kind::kSame;
    std::uint64_t baseline = 0;
    std::uint64_t measured = 0;
};

struct Verdict {
    bool comparable = true;  ///< measured in the baseline's environment
    std::vector<JobVerdict> jobs;

    /// The counts are comparable, and one has grown or the baseline lists other jobs.
    [[nodiscard]] bool failed() const;
};

/// `margin` is a fraction: 0.03 lets a count grow by 3 %.
[[nodiscard]] Verdict compareCounts(const Counts& baseline, const Counts& measured, double margin);
/// A table and what to do about it.
[[nodiscard]] std::string verdictText(const Verdict& verdict, const Counts& baseline, const Counts& measured,
                                      double margin);

/// Describes this machine and program. Errors: kUnavailable: `valgrind` cannot be run.
[[nodiscard]] Result<CountingEnvironment> countingEnvironment(const std::string& valgrind);
/// Runs `program` `job NAME --folder FOLDER` under callgrind. Errors: kUnavailable, kInternal.
[[nodiscard]] Result<std::uint64_t> countInstructions(const std::string& valgrind, const std::string& program,
                                                      const std::string& job, const std::string& folder);

}  // namespace shapedb::bench
