// SPDX-License-Identifier: GPL-3.0-or-later
// `shapedb-bench instructions`: counts the instructions of small fixed jobs and compares them with a file;
// `shapedb-bench job` runs one of them, for a profiler.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

#include <CLI/CLI.hpp>

#include "bench/instructions.h"
#include "bench/jobs.h"
#include "bench/operations.h"
#include "bench/output.h"
#include "bench/server_process.h"
#include "client/cli/console.h"
#include "client/cli/evaluation_run.h"
#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

struct InstructionFlags {
    std::string baseline;
    double margin = 0.03;
    bool update = false;
    std::string valgrind = "valgrind";
    std::string program;
    std::string folder;
};

const Job* findJob(const std::string& name) {
    for (const Job& job : jobs()) {
        if (job.name == name) return &job;
    }
    return nullptr;
}

/// `folder`, or `own` if that is empty; missing inputs are made.
Result<JobFolder> inputFolder(const WorkDirectory& own, const std::string& folder) {
    JobFolder input{folder.empty() ? own.path() : folder};
    if (!std::filesystem::exists(input.signatures())) {
        RETURN_IF_ERROR(prepareJobs(input, cli::defaultThreads()));
    }
    return input;
}

Result<int> runJob(const std::string& name, const std::string& folder) {
    const auto own = WorkDirectory::create("");
    RETURN_IF_ERROR(own);
    const auto where = inputFolder(*own, folder);
    RETURN_IF_ERROR(where);
    const auto work = findJob(name)->prepare(*where);
    RETURN_IF_ERROR(work);
    RETURN_IF_ERROR(runCounted(*work));
    return cli::kOk;
}

Result<Counts> countAll(const InstructionFlags& flags, Bench& bench) {
    Counts counts;
    const auto environment = countingEnvironment(flags.valgrind);
    RETURN_IF_ERROR(environment);
    counts.environment = *environment;
    const auto own = WorkDirectory::create("");
    RETURN_IF_ERROR(own);
    // Here and not under callgrind, where it would take minutes.
    const auto input = inputFolder(*own, flags.folder);
    RETURN_IF_ERROR(input);
    for (const Job& job : jobs()) {
        bench.console.progress(job.name, counts.jobs.size(), jobs().size());
        RETURN_IF_ERROR(bench.context().checkpoint());
        const auto count = countInstructions(flags.valgrind, flags.program, job.name, input->path);
        RETURN_IF_ERROR(count);
        counts.jobs[job.name] = *count;
    }
    return counts;
}

Result<Counts> readBaseline(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) return fail(ErrorCode::kFileNotReadable, "cannot read the baseline " + path);
    return parseCounts({std::istreambuf_iterator<char>(file), {}});
}

Result<int> runInstructions(const InstructionFlags& flags, Bench& bench) {
    if (flags.update) {
        const auto counts = countAll(flags, bench);
        RETURN_IF_ERROR(counts);
        RETURN_IF_ERROR(writeText(flags.baseline, countsText(*counts)));
        bench.console.text("wrote " + flags.baseline + "\n");
        return cli::kOk;
    }
    // Before the minute of counting.
    const auto baseline = readBaseline(flags.baseline);
    RETURN_IF_ERROR(baseline);
    const auto counts = countAll(flags, bench);
    RETURN_IF_ERROR(counts);
    const Verdict verdict = compareCounts(*baseline, *counts, flags.margin);
    bench.console.text(verdictText(verdict, *baseline, *counts, flags.margin));
    return verdict.failed() ? cli::kSomeFailed : cli::kOk;
}

std::string thisProgram() {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    return error ? std::string("shapedb-bench") : self.string();
}

}  // namespace

void addInstructionsOperation(CLI::App& app, Bench& bench) {
    auto flags = std::make_shared<InstructionFlags>();
    flags->program = thisProgram();
    CLI::App* command = app.add_subcommand(
        "instructions", "Compares the instruction counts of small fixed jobs with a baseline file");
    command->add_option("BASELINE", flags->baseline, "JSON, as --update writes it")->required();
    command->add_option("--margin", flags->margin, "Fraction by which a count may grow")
        ->check(CLI::Range(0.0, 10.0))
        ->capture_default_str();
    command->add_flag("--update", flags->update, "Write the counts to BASELINE instead of comparing");
    command->add_option("--valgrind", flags->valgrind, "The program that counts")->capture_default_str();
    command->add_option("--program", flags->program, "The shapedb-bench to count [this one]");
    command->add_option("--folder", flags->folder,
                        "Folder for the jobs' input files; missing ones are made [temporary]");
    command->callback(
        [flags, &bench] { bench.action = [flags, &bench] { return runInstructions(*flags, bench); }; });
}

void addJobOperation(CLI::App& app, Bench& bench) {
    struct Flags {
        std::string name;
        std::string folder;
    };
    auto flags = std::make_shared<Flags>();
    std::string list;
    std::vector<std::string> names;
    for (const Job& job : jobs()) {
        names.emplace_back(job.name);
        list += "\n" + std::string(job.name) + ": " + job.description;
    }
    CLI::App* command =
        app.add_subcommand("job", "Runs one of the jobs of `instructions`, for use under a profiler");
    command->add_option("NAME", flags->name, "Which:" + list)->required()->check(CLI::IsMember(names));
    command->add_option("--folder", flags->folder,
                        "Folder for its input files; missing ones are made [temporary]");
    command->callback(
        [flags, &bench] { bench.action = [flags] { return runJob(flags->name, flags->folder); }; });
}

}  // namespace shapedb::bench
