// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/integration/support/server_process.h"

#include <cstdio>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace shapedb::testing {

std::string readFile(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

Finished runServer(const std::vector<std::string>& arguments,
                   const std::map<std::string, std::string>& environment) {
    const TemporaryDirectory directory;
    const auto create = [&](const char* name) {
        return ::open((directory.path() + name).c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    };
    const int out = create("/out");
    const int err = create("/err");
    auto process = ChildProcess::start(SHAPEDBD_PATH, arguments, environment, out, err);
    ::close(out);
    ::close(err);
    EXPECT_TRUE(process) << process.error().message;
    const int exitCode = process ? process->wait() : -1;
    return {exitCode, readFile(directory.path() + "/out"), readFile(directory.path() + "/err")};
}

ServerProcess::ServerProcess(const std::string& directory, const std::vector<std::string>& flags)
    : logFile_(directory + "/server.log") {
    ShapedbdProcess::Options options;
    options.program = SHAPEDBD_PATH;
    options.data = directory + "/data";
    options.logFile = logFile_;
    options.flags = flags;
    auto started = ShapedbdProcess::start(options);
    if (started) {
        server_.emplace(std::move(*started));
        address_ = server_->address();
        banner_ = server_->banner();
    } else {
        ADD_FAILURE() << started.error().message;
    }
}

ServerProcess::~ServerProcess() {
    server_.reset();
    if (::testing::Test::HasFailure()) std::fprintf(stderr, "--- log of shapedbd\n%s---\n", log().c_str());
}

void ServerProcess::signal(int number) const {
    if (server_) server_->process().signal(number);
}

bool ServerProcess::running() const { return server_ && server_->process().running(); }

int ServerProcess::wait(std::chrono::seconds atMost) {
    return server_ ? server_->process().wait(atMost) : -1;
}

void ServerProcess::kill() {
    if (server_) server_->process().kill();
}

std::string ServerProcess::log() const { return readFile(logFile_); }

}  // namespace shapedb::testing
