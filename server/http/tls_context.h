// SPDX-License-Identifier: GPL-3.0-or-later
// OpenSSL's settings for the connections of one certificate.
#pragma once

#include <memory>

#include <boost/asio/ssl/context.hpp>

#include "core/base/error.h"
#include "server/security/certificate.h"

namespace shapedb::http {

/// TLS 1.2 or later, as for gRPC; with `clientCas` clients must show a certificate signed by one of them.
/// Errors: kMalformedFile (OpenSSL does not take what loadTlsIdentity took).
[[nodiscard]] Result<std::shared_ptr<boost::asio::ssl::context>> makeTlsContext(
    const security::TlsIdentity& identity);

}  // namespace shapedb::http
