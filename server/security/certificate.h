// SPDX-License-Identifier: GPL-3.0-or-later
// Certificates and keys for TLS, read from files and checked before anybody depends on them.
#pragma once

#include <optional>
#include <string>

#include "core/base/error.h"
#include "server/security/key.h"

namespace shapedb::security {

struct TlsFiles {
    std::string certificate;  ///< PEM: the server's, then those between it and the authority
    std::string key;          ///< PEM, not encrypted
    std::string clientCa;     ///< PEM: who signs the certificates of clients; empty: clients need none
};

/// What the files hold.
struct TlsIdentity {
    std::string pem;        ///< key and certificates, for both roles of one file
    std::string clientCas;  ///< PEM; empty: clients need no certificate
    std::string subject;    ///< of the server's certificate, for logs
    UnixMs notAfter = 0;    ///< when the server's certificate expires
    bool keyIsReadableByOthers = false;
};

/// Errors, which name the file: kFileNotReadable; kMalformedFile (no certificate, a damaged one, no key or an
/// encrypted one, the key is of another certificate, or too weak for TLS); kRejected (the certificate has
/// expired by `now` or is not valid yet).
[[nodiscard]] Result<TlsIdentity> loadTlsIdentity(const TlsFiles& files, UnixMs now);

}  // namespace shapedb::security
