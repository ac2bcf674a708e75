// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/health.h"

#include <chrono>
#include <string_view>
#include <utility>

namespace shapedb::rpc {
namespace {

constexpr std::chrono::milliseconds kLook{100};

/// What must work for a name to be SERVING, besides a server that listens and is not shutting down.
enum class Need {
    kNothing,
    kContent,       ///< collections can be looked up
    kSearches,      ///< and searched as a whole
    kSegmentation,  ///< and scans are taken in
    kComplete,      ///< no acknowledged change is missing
};

struct Name {
    const char* name;
    Need need;
};
// The services of the API, and parts that can fail on their own. The empty name is the server as a whole. All
// names are documented; others are NOT_FOUND.
constexpr Name kNames[] = {
    {"", Need::kContent},
    {"shapedb.v1.ShapeService", Need::kContent},
    {"shapedb.v1.SearchService", Need::kSearches},
    {"shapedb.v1.CollectionService", Need::kContent},
    {"shapedb.v1.AlignService", Need::kContent},
    {"shapedb.v1.AdminService", Need::kNothing},  // a restore is the way out of lost content
    {"shapedb.segmentation", Need::kSegmentation},
    {"shapedb.storage", Need::kComplete},
};

bool has(const catalog::Condition& condition, Need need) {
    switch (need) {
        case Need::kNothing: return true;
        case Need::kContent: return condition.content;
        case Need::kSearches: return condition.content && condition.searches;
        case Need::kSegmentation: return condition.content && condition.segmentation;
        case Need::kComplete: return condition.complete;
    }
    return false;
}

}  // namespace

std::vector<const char*> serviceNames() {
    std::vector<const char*> names;
    for (const Name& name : kNames)
        if (std::string_view(name.name).rfind("shapedb.v1.", 0) == 0) names.push_back(name.name);
    return names;
}

Health::Health(grpc::HealthCheckServiceInterface& service, std::function<catalog::Condition()> condition)
    : service_(service), condition_(std::move(condition)) {
    look();
    looking_ = std::make_unique<RepeatingThread>(kLook, [this] { look(); });
}

Health::~Health() { stop(); }

void Health::look() {
    const catalog::Condition condition = condition_();
    const std::lock_guard<std::mutex> lock(mutex_);
    now_ = condition;
    tell();
}

/// Under the lock. Only what changed, for watchers are woken by it.
void Health::tell() {
    for (const Name& name : kNames) {
        const bool serving = !ending_ && inTrouble_ == 0 && has(now_, name.need);
        const auto [told, isNew] = told_.emplace(name.name, serving);
        if (!isNew && told->second == serving) continue;
        told->second = serving;
        service_.SetServingStatus(name.name, serving);
    }
}

void Health::listenerFailed() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++inTrouble_;
    tell();
}

void Health::listenerRecovered() {
    const std::lock_guard<std::mutex> lock(mutex_);
    --inTrouble_;
    tell();
}

bool Health::accepting() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return inTrouble_ == 0;
}

bool Health::serving() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return told_.at("");
}

void Health::end() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
    tell();
}

void Health::stop() { looking_.reset(); }

}  // namespace shapedb::rpc
