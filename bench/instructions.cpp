// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/instructions.h"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include <gnu/libc-version.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "bench/jobs.h"
#include "bench/output.h"
#include "client/cli/console.h"
#include "client/cli/text.h"

namespace shapedb::bench {

namespace {

using nlohmann::json;

/// What glibc and OpenSSL select functions by, as far as valgrind reports it.
constexpr std::array<const char*, 6> kInstructionSets = {"avx2", "bmi2", "erms", "fma", "sha_ni", "ssse3"};

std::string processorSets() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        if (line.rfind("flags", 0) != 0) continue;
        std::istringstream words(line);
        const std::set<std::string> flags{std::istream_iterator<std::string>(words), {}};
        std::string text;
        for (const char* name : kInstructionSets) {
            if (flags.count(name) != 0) text += (text.empty() ? "" : " ") + std::string(name);
        }
        return text;
    }
    return "unknown";
}

/// For the shell: in single quotes.
std::string quoted(const std::string& argument) {
    std::string text = "'";
    for (const char c : argument) {
        if (c == '\'') {
            text += "'\\''";
        } else {
            text += c;
        }
    }
    return text + "'";
}

struct Output {
    int status = -1;  ///< exit code; -1: killed or not started
    std::string text;
};

/// Standard output and error together.
Output runShell(const std::string& command) {
    Output output;
    std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
    if (pipe == nullptr) return output;
    std::array<char, 4096> buffer{};
    while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe))
        output.text.append(buffer.data(), count);
    const int status = ::pclose(pipe);
    if (WIFEXITED(status)) output.status = WEXITSTATUS(status);
    return output;
}

std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

tl::unexpected<Error> malformed(const std::string& what) {
    return fail(ErrorCode::kMalformedFile, "instruction counts: " + what);
}

const char* word(JobVerdict::Kind kind) {
    switch (kind) {
        case JobVerdict::Kind::kSame: return "";
        case JobVerdict::Kind::kLess: return "fewer";
        case JobVerdict::Kind::kMore: return "MORE";
        case JobVerdict::Kind::kNew: return "not in the baseline";
        case JobVerdict::Kind::kGone: return "no such job any more";
    }
    return "";
}

JobVerdict::Kind kindOf(std::uint64_t baseline, std::uint64_t measured, double margin) {
    const auto before = static_cast<double>(baseline);
    const auto now = static_cast<double>(measured);
    if (now > before * (1.0 + margin)) return JobVerdict::Kind::kMore;
    if (now < before * (1.0 - margin)) return JobVerdict::Kind::kLess;
    return JobVerdict::Kind::kSame;
}

std::string changeText(const JobVerdict& job) {
    if (job.baseline == 0 || job.measured == 0) return "-";
    const double share = static_cast<double>(job.measured) / static_cast<double>(job.baseline) - 1.0;
    return (share >= 0.0 ? "+" : "") + cli::formatFixed(100.0 * share, 2) + " %";
}

}  // namespace

std::string CountingEnvironment::text() const {
    return "compiler " + compiler + ", build type " + buildType + ", glibc " + libc + ", " + valgrind +
           ", instruction sets " + processor;
}

bool operator==(const CountingEnvironment& a, const CountingEnvironment& b) { return a.text() == b.text(); }

Result<Counts> parseCounts(const std::string& text) {
    const json document = json::parse(text, nullptr, false);
    if (!document.is_object()) return malformed("no JSON object");
    try {
        Counts counts;
        const json& environment = document.at("environment");
        counts.environment = {environment.at("compiler"), environment.at("build_type"),
                              environment.at("libc"), environment.at("valgrind"),
                              environment.at("processor")};
        counts.jobs = document.at("instructions").get<std::map<std::string, std::uint64_t>>();
        return counts;
    } catch (const json::exception& error) {
        return malformed(error.what());
    }
}

std::string countsText(const Counts& counts) {
    const CountingEnvironment& environment = counts.environment;
    const json document = {{"environment",
                            {{"compiler", environment.compiler},
                             {"build_type", environment.buildType},
                             {"libc", environment.libc},
                             {"valgrind", environment.valgrind},
                             {"processor", environment.processor}}},
                           {"instructions", counts.jobs}};
    return cli::dump(document) + "\n";
}

bool Verdict::failed() const {
    if (!comparable) return false;
    for (const JobVerdict& job : jobs) {
        if (job.kind == JobVerdict::Kind::kMore || job.kind == JobVerdict::Kind::kNew ||
            job.kind == JobVerdict::Kind::kGone) {
            return true;
        }
    }
    return false;
}

Verdict compareCounts(const Counts& baseline, const Counts& measured, double margin) {
    Verdict verdict;
    verdict.comparable = baseline.environment == measured.environment;
    for (const auto& [name, count] : measured.jobs) {
        const auto before = baseline.jobs.find(name);
        if (before == baseline.jobs.end()) {
            verdict.jobs.push_back({name, JobVerdict::Kind::kNew, 0, count});
        } else {
            verdict.jobs.push_back({name, kindOf(before->second, count, margin), before->second, count});
        }
    }
    for (const auto& [name, count] : baseline.jobs) {
        if (measured.jobs.count(name) == 0) verdict.jobs.push_back({name, JobVerdict::Kind::kGone, count, 0});
    }
    return verdict;
}

std::string verdictText(const Verdict& verdict, const Counts& baseline, const Counts& measured,
                        double margin) {
    std::string text = "| job | baseline | now | change | |\n|---|---:|---:|---:|---|\n";
    bool less = false;
    for (const JobVerdict& job : verdict.jobs) {
        text += "| " + job.name + " | " + cli::formatCount(job.baseline) + " | " +
                cli::formatCount(job.measured) + " | " + changeText(job) + " | " + word(job.kind) + " |\n";
        less = less || job.kind == JobVerdict::Kind::kLess;
    }
    const std::string allowed = cli::formatFixed(100.0 * margin, 1) + " %";
    if (!verdict.comparable) {
        return text +
               "\nNOT COMPARED: the baseline was counted elsewhere, so this proves nothing.\n  baseline: " +
               baseline.environment.text() + "\n  here:     " + measured.environment.text() + "\n";
    }
    if (verdict.failed()) {
        return text + "\nFAILED: a job takes over " + allowed +
               " more instructions than the baseline, or is not in it. Make it cheaper, or, when the work is "
               "worth it, commit what scripts/ci/instructions.sh --update writes and say why.\n";
    }
    return text + "\nKept within " + allowed +
           (less ? "; some jobs got cheaper: commit what scripts/ci/instructions.sh --update writes.\n"
                 : ".\n");
}

Result<CountingEnvironment> countingEnvironment(const std::string& valgrind) {
    const Output version = runShell(quoted(valgrind) + " --version");
    if (version.status != 0) {
        return fail(
            ErrorCode::kUnavailable,
            "cannot run " + valgrind + ": install it (scripts/install-deps.sh) or name it with --valgrind");
    }
    const Environment here = environment();
    return CountingEnvironment{here.compiler, here.buildType, gnu_get_libc_version(), firstLine(version.text),
                               processorSets()};
}

Result<std::uint64_t> countInstructions(const std::string& valgrind, const std::string& program,
                                        const std::string& job, const std::string& folder) {
    const std::string file = folder + "/callgrind.out";
    const Output output =
        runShell(quoted(valgrind) + " --tool=callgrind --callgrind-out-file=" + quoted(file) +
                 " --toggle-collect=" + kCountedFunction + " " + quoted(program) + " job " + quoted(job) +
                 " --folder " + quoted(folder));
    if (output.status != 0)
        return fail(ErrorCode::kInternal, "job " + job + " failed under callgrind:\n" + output.text);
    std::ifstream result(file);
    std::uint64_t count = 0;
    for (std::string line; std::getline(result, line);) {
        if (line.rfind("summary: ", 0) == 0 || line.rfind("totals: ", 0) == 0)
            count = std::strtoull(line.c_str() + line.find(' '), nullptr, 10);
    }
    std::remove(file.c_str());
    if (count == 0) {
        return fail(ErrorCode::kInternal,
                    "callgrind counted nothing for job " + job + ": is the program stripped of its symbols?");
    }
    return count;
}

}  // namespace shapedb::bench
