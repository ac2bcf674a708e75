#include "server/security/usage_saver.h"

#include <chrono>
#include <utility>

namespace shapedb::security {
namespace {

constexpr std::chrono::seconds kSaveEvery{10};

}  // namespace

UsageSaver::UsageSaver(Keyring& keyring, telemetry::LoggerPtr log)
    : keyring_(keyring), log_(std::move(log)), thread_([this] { run(); }) {}

UsageSaver::~UsageSaver() {
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        ending_ = true;
    }
    wake_.notify_all();
    thread_.join();
    save();
}

void UsageSaver::run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!wake_.wait_for(lock, kSaveEvery, [this] { return ending_; })) save();
}

void UsageSaver::save() {
    const auto saved = keyring_.saveUsage();
    if (!saved && !failing_) {
        log_->error("what API keys have used cannot be stored", telemetry::fieldsOf(saved.error()));
    }
    failing_ = !saved;
}

}  // namespace shapedb::security
