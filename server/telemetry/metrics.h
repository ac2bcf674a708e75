// SPDX-License-Identifier: GPL-3.0-or-later
// What the server does, in numbers, for Prometheus. docs/metrics.md lists them.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace shapedb::telemetry {

/// One number at the moment it is asked for.
struct Sample {
    enum class Kind {
        kGauge,
        kCounter,  ///< only grows while the server runs; its name ends in _total
    };
    const char* name;  ///< in base units: seconds, bytes, or a count
    const char* help;
    Kind kind = Kind::kGauge;
    double value = 0.0;
    std::vector<std::pair<std::string, std::string>> labels{};  ///< of few values, none from a client
};
using Sampler = std::function<std::vector<Sample>()>;

/// Thread-safe.
class Metrics {
  public:
    Metrics();
    ~Metrics();
    Metrics(const Metrics&) = delete;
    Metrics& operator=(const Metrics&) = delete;

    /// A call that has ended. `rpc` and `code` come from a fixed set.
    void recordCall(const char* rpc, const char* code, double seconds, std::uint64_t pointBytes);

    /// Called whenever the numbers are asked for, from another thread, until `stop`. Call once, before
    /// `serve`.
    void setSampler(Sampler sampler);
    /// Serves http://ADDRESS/metrics until `stop`; returns the port. Errors: kUnavailable (cannot listen).
    [[nodiscard]] Result<int> serve(const std::string& address);
    /// Idempotent; the destructor does it too.
    void stop();

    /// The page that is served.
    [[nodiscard]] std::string page() const;

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

/// Memory, processor time and open files of this process, and when it `started`, under the names that
/// Prometheus gives them everywhere.
[[nodiscard]] std::vector<Sample> sampleProcess(std::chrono::system_clock::time_point started);

}  // namespace shapedb::telemetry
