// SPDX-License-Identifier: GPL-3.0-or-later
// What grpc.health.v1 says of the server and of each of its services (docs/operations.md#health).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <grpcpp/health_check_service_interface.h>

#include "common/repeating_thread.h"
#include "server/catalog/catalog.h"

namespace shapedb::rpc {

/// The full names of all services of the API: "shapedb.v1.ShapeService" and so on.
[[nodiscard]] std::vector<const char*> serviceNames();

/// Thread-safe.
class Health {
  public:
    /// `condition` is asked again and again until `stop`. Neither is owned; the service must outlive this or
    /// `stop`.
    Health(grpc::HealthCheckServiceInterface& service, std::function<catalog::Condition()> condition);
    /// As `stop`.
    ~Health();

    /// A listener cannot accept connections, or can again.
    void listenerFailed();
    void listenerRecovered();
    /// The health of the server as a whole.
    [[nodiscard]] bool serving() const;
    /// Whether all listeners accept connections.
    [[nodiscard]] bool accepting() const;
    /// From now on nothing is served, whatever happens.
    void end();
    /// Asks no more. Idempotent.
    void stop();

  private:
    void look();
    void tell();

    grpc::HealthCheckServiceInterface& service_;
    const std::function<catalog::Condition()> condition_;
    mutable std::mutex mutex_;
    bool ending_ = false;
    int inTrouble_ = 0;  ///< listeners that cannot accept
    catalog::Condition now_;
    std::map<std::string, bool> told_;
    std::unique_ptr<RepeatingThread> looking_;  ///< last: it uses the others
};

}  // namespace shapedb::rpc
