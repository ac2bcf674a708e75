// SPDX-License-Identifier: GPL-3.0-or-later
// Clients that send SearchBatch without a pause, in a process of their own: inside the measuring client they
// would share its locks and memory, and delays there would be blamed on the server.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/load_run.h"
#include "bench/server_process.h"
#include "common/child_process.h"
#include "core/base/error.h"

namespace shapedb::bench {

/// They leave the processors to the server as far as the system allows, and are killed when destroyed.
class BatchClients {
  public:
    /// settings.batchClients of them send batches of settings.batchQueries of the `queries`, which are
    /// encoded signatures; `directory` is for their files. Errors: kFileNotWritable, kInternal.
    [[nodiscard]] static Result<BatchClients> start(const LoadSettings& settings, const ServerProcess& server,
                                                    const std::vector<std::string>& queries,
                                                    const std::string& directory);

    /// Errors: kUnavailable: they have ended, because a batch failed.
    [[nodiscard]] Result<void> requireRunning() const;

  private:
    BatchClients(ChildProcess process, std::string log)
        : process_(std::move(process)), log_(std::move(log)) {}

    ChildProcess process_;
    std::string log_;
};

}  // namespace shapedb::bench
