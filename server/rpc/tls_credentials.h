// SPDX-License-Identifier: GPL-3.0-or-later
// gRPC's credentials for TLS from files that may be replaced while the server runs.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <grpcpp/security/server_credentials.h>

#include "common/repeating_thread.h"
#include "core/base/error.h"
#include "server/security/certificate.h"
#include "server/telemetry/logger.h"

namespace shapedb::rpc {

/// Looks at the files every second. New ones are used for new connections once key and certificate have been
/// checked to belong together; until then the old ones stay, and the log says why. Open connections are left
/// alone.
///
/// gRPC's own watcher hands whatever it reads to the next handshake, and reads key and certificate apart. It
/// therefore watches not the files but one private copy of both in memory, which is replaced as a whole.
class TlsCredentials {
  public:
    /// Another transport that uses the same files; called with each identity before gRPC gets it, which it
    /// then does only after success.
    using AlsoUse = std::function<Result<void>(const security::TlsIdentity&)>;

    /// `alsoUse` may be empty. Errors: those of security::loadTlsIdentity and of `alsoUse`; kInternal (no
    /// memory file).
    [[nodiscard]] static Result<std::unique_ptr<TlsCredentials>> start(security::TlsFiles files,
                                                                       AlsoUse alsoUse,
                                                                       telemetry::LoggerPtr log);
    TlsCredentials(const TlsCredentials&) = delete;
    TlsCredentials& operator=(const TlsCredentials&) = delete;

    /// For the server that this outlives.
    [[nodiscard]] std::shared_ptr<grpc::ServerCredentials> credentials() const { return credentials_; }

    /// When the certificate in use expires.
    [[nodiscard]] security::UnixMs expires() const { return expires_.load(); }

  private:
    /// A file in memory that has a path of its own for as long as it lives.
    class MemoryFile {
      public:
        ~MemoryFile();
        /// Replaces the content: who opens the path gets the old one or the new one whole.
        [[nodiscard]] Result<void> replace(const std::string& content);
        [[nodiscard]] std::string path() const;

      private:
        int slot_ = -1;
        long modified_ = 1;  ///< seconds; gRPC compares them to tell versions apart
    };

    TlsCredentials(security::TlsFiles files, AlsoUse alsoUse, telemetry::LoggerPtr log);
    Result<void> use(const security::TlsIdentity& identity);
    void warnOfTrouble(const security::TlsIdentity& identity);
    void look();

    const security::TlsFiles files_;
    const AlsoUse alsoUse_;
    const telemetry::LoggerPtr log_;
    MemoryFile identity_;
    MemoryFile clientCas_;
    std::shared_ptr<grpc::ServerCredentials> credentials_;
    std::string used_;     ///< content in use
    std::string problem_;  ///< of the files, as last logged
    std::atomic<security::UnixMs> expires_{0};
    bool toldOfExpiry_ = false;
    std::optional<RepeatingThread> watcher_;  ///< the last, so that it ends first
};

}  // namespace shapedb::rpc
