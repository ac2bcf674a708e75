// SPDX-License-Identifier: GPL-3.0-or-later
// Writes what API keys have used, now and then.
#pragma once

#include <optional>

#include "common/repeating_thread.h"
#include "server/security/keyring.h"
#include "server/telemetry/logger.h"

namespace shapedb::security {

/// Saves every ten seconds while it lives, and once more when it is destroyed.
class UsageSaver {
  public:
    /// `keyring` must outlive this.
    UsageSaver(Keyring& keyring, telemetry::LoggerPtr log);
    ~UsageSaver();
    UsageSaver(const UsageSaver&) = delete;
    UsageSaver& operator=(const UsageSaver&) = delete;

  private:
    void save();

    Keyring& keyring_;
    const telemetry::LoggerPtr log_;
    bool failing_ = false;  ///< reported once
    std::optional<RepeatingThread> thread_;
};

}  // namespace shapedb::security
