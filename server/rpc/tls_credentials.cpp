// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/rpc/tls_credentials.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/return_if_error.h"
#include "server/security/keyring.h"

namespace shapedb::rpc {
namespace {

constexpr unsigned kWatchSeconds = 1;
constexpr security::UnixMs kWarnBeforeExpiryMs = security::UnixMs{14} * 86'400'000;

tl::unexpected<Error> noMemoryFile() {
    return fail(ErrorCode::kInternal,
                "no file in memory for the TLS key: " + std::generic_category().message(errno));
}

bool writeAll(int file, const std::string& content) {
    std::size_t at = 0;
    while (at < content.size()) {
        const ssize_t written = ::write(file, content.data() + at, content.size() - at);
        if (written <= 0) return false;
        at += static_cast<std::size_t>(written);
    }
    return true;
}

}  // namespace

TlsCredentials::MemoryFile::~MemoryFile() {
    if (slot_ >= 0) ::close(slot_);
}

std::string TlsCredentials::MemoryFile::path() const { return "/proc/self/fd/" + std::to_string(slot_); }

Result<void> TlsCredentials::MemoryFile::replace(const std::string& content) {
    const int fresh = ::memfd_create("shapedb-tls", MFD_CLOEXEC);
    if (fresh < 0) return noMemoryFile();
    const std::array<timespec, 2> times{timespec{++modified_, 0}, timespec{modified_, 0}};
    const bool complete = writeAll(fresh, content) && ::futimens(fresh, times.data()) == 0;
    if (complete && slot_ < 0) {
        slot_ = fresh;
        return {};
    }
    const bool replaced = complete && ::dup3(fresh, slot_, O_CLOEXEC) >= 0;
    const int why = errno;
    ::close(fresh);
    errno = why;
    return replaced ? Result<void>() : noMemoryFile();
}

TlsCredentials::TlsCredentials(security::TlsFiles files, AlsoUse alsoUse, telemetry::LoggerPtr log)
    : files_(std::move(files)), alsoUse_(std::move(alsoUse)), log_(std::move(log)) {}

Result<std::unique_ptr<TlsCredentials>> TlsCredentials::start(security::TlsFiles files, AlsoUse alsoUse,
                                                              telemetry::LoggerPtr log) {
    std::unique_ptr<TlsCredentials> tls(
        new TlsCredentials(std::move(files), std::move(alsoUse), std::move(log)));
    const auto identity = security::loadTlsIdentity(tls->files_, security::systemClock().wall());
    RETURN_IF_ERROR(identity);
    RETURN_IF_ERROR(tls->use(*identity));
    const std::string path = tls->identity_.path();
    using Provider = grpc::experimental::FileWatcherCertificateProvider;
    const bool mutual = !identity->clientCas.empty();
    const auto provider = mutual
                              ? std::make_shared<Provider>(path, path, tls->clientCas_.path(), kWatchSeconds)
                              : std::make_shared<Provider>(path, path, kWatchSeconds);
    grpc::experimental::TlsServerCredentialsOptions options(provider);
    options.watch_identity_key_cert_pairs();
    if (mutual) {
        options.watch_root_certs();
        options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
    }
    tls->credentials_ = grpc::experimental::TlsServerCredentials(options);
    tls->watcher_.emplace(std::chrono::seconds(kWatchSeconds), [raw = tls.get()] { raw->look(); });
    return tls;
}

Result<void> TlsCredentials::use(const security::TlsIdentity& identity) {
    if (alsoUse_) RETURN_IF_ERROR(alsoUse_(identity));
    if (!identity.clientCas.empty()) {
        RETURN_IF_ERROR(clientCas_.replace(identity.clientCas));
    }
    RETURN_IF_ERROR(identity_.replace(identity.pem));
    used_ = identity.pem + identity.clientCas;
    expires_ = identity.notAfter;
    problem_.clear();
    toldOfExpiry_ = false;
    log_->info("TLS certificate in use", {{"subject", identity.subject}, {"file", files_.certificate}});
    if (identity.keyIsReadableByOthers) {
        log_->warn("every user of this machine can read the TLS key: allow it to the server only",
                   {{"file", files_.key}});
    }
    return {};
}

void TlsCredentials::warnOfTrouble(const security::TlsIdentity& identity) {
    if (toldOfExpiry_ || security::systemClock().wall() < identity.notAfter - kWarnBeforeExpiryMs) return;
    toldOfExpiry_ = true;
    log_->warn("the TLS certificate expires within two weeks: replace its files, the server need not stop",
               {{"subject", identity.subject}, {"file", files_.certificate}});
}

void TlsCredentials::look() {
    auto identity = security::loadTlsIdentity(files_, security::systemClock().wall());
    Result<void> good;
    if (!identity) {
        good = fail(identity.error());
    } else {
        warnOfTrouble(*identity);
        if (identity->pem + identity->clientCas != used_) good = use(*identity);
    }
    const std::string problem = good ? std::string() : good.error().message;
    if (problem != problem_ && !problem.empty()) {
        log_->error("the TLS files cannot be used: the server goes on with those it has",
                    {{"reason", problem}});
    }
    problem_ = problem;
}

}  // namespace shapedb::rpc
