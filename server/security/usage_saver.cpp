// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/usage_saver.h"

#include <chrono>
#include <utility>

namespace shapedb::security {
namespace {

constexpr std::chrono::seconds kSaveEvery{10};

}  // namespace

UsageSaver::UsageSaver(Keyring& keyring, telemetry::LoggerPtr log)
    : keyring_(keyring), log_(std::move(log)), thread_(std::in_place, kSaveEvery, [this] { save(); }) {}

UsageSaver::~UsageSaver() {
    thread_.reset();
    save();
}

void UsageSaver::save() {
    const auto saved = keyring_.saveUsage();
    if (!saved && !failing_) {
        log_->error("what API keys have used cannot be stored", telemetry::fieldsOf(saved.error()));
    }
    failing_ = !saved;
}

}  // namespace shapedb::security
