// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reliability/support/failpoints.h"

#include <filesystem>
#include <mutex>
#include <regex>

#include <unistd.h>

#include "server/store/failpoints.h"
#include "tests/reliability/support/files.h"

namespace shapedb::reliability {

namespace {

/// Failpoints are reached where memory is made to run out, too: nothing is counted unless somebody asked.
bool counting = false;
std::mutex guard;
std::map<std::string, int> counts;
std::string deadly;
int deadlyTime = 0;

}  // namespace

std::map<std::string, int> Failpoints::reached() {
    const std::lock_guard<std::mutex> lock(guard);
    counting = false;
    return counts;
}

void Failpoints::forget() {
    const std::lock_guard<std::mutex> lock(guard);
    counting = true;
    counts.clear();
}

void Failpoints::dieAt(const std::string& name, int time) {
    forget();
    deadly = name;
    deadlyTime = time;
}

std::set<std::string> Failpoints::inSources() {
    std::set<std::string> names;
    const std::regex use("SHAPEDB_FAILPOINT\\(\"([^\"]+)\"\\)");
    for (const auto& entry : std::filesystem::recursive_directory_iterator(SHAPEDB_SERVER_DIR)) {
        if (entry.path().extension() != ".cpp") continue;
        const std::string text = readFile(entry.path().string());
        for (std::sregex_iterator i(text.begin(), text.end(), use), end; i != end; ++i)
            names.insert("failpoint:" + (*i)[1].str());
    }
    return names;
}

}  // namespace shapedb::reliability

namespace shapedb {

void reachFailpoint(const char* name) noexcept {
    using namespace reliability;
    if (!counting) return;
    const std::lock_guard<std::mutex> lock(guard);
    const int times = ++counts[name];
    if (deadly == name && times == deadlyTime) ::_exit(kDiedThere);
}

}  // namespace shapedb
