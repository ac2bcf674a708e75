// What the handlers work with.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "server/config/server_config.h"
#include "server/index/collection_index.h"
#include "server/ingest/progress_board.h"
#include "server/ingest/rebuild_driver.h"
#include "server/ingest/signature_pipeline.h"
#include "server/ingest/worker_pool.h"
#include "server/rpc/cancel_watcher.h"
#include "server/rpc/gates.h"
#include "server/rpc/search_runner.h"
#include "server/store/store.h"
#include "server/telemetry/logger.h"

namespace shapedb::rpc {

/// References to everything, owned by the daemon, which outlives all handlers. Each member is
/// thread-safe.
struct Services {
    const config::ServerConfig& config;
    store::Store& store;
    index::CollectionIndex& index;
    ingest::WorkerPool& workers;
    ingest::RebuildDriver& rebuilds;
    ingest::ProgressBoard& board;
    ingest::SignaturePipeline describe;
    telemetry::LoggerPtr log;
    CancelWatcher& cancellations;
    CallGate& calls;
    RestoreGate& restores;
    SegmentationSlots& slots;
    Budget& uploads;    ///< bytes of points being received
    Budget& followers;  ///< calls that wait for a shape or a rebuild
    SearchRunner& searches;
    std::string temporaryDirectory;  ///< exists; for backup and restore files
    std::chrono::system_clock::time_point started;
};

}  // namespace shapedb::rpc
