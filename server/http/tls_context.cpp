// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/tls_context.h"

#include <array>
#include <string>

#include <openssl/ssl.h>

namespace shapedb::http {
namespace {

namespace ssl = boost::asio::ssl;

/// Clients that offer protocols are told that ours is HTTP/1.1; others need not be.
int chooseProtocol(SSL* /*unused*/, const unsigned char** chosen, unsigned char* chosenSize,
                   const unsigned char* offered, unsigned offeredSize, void* /*unused*/) {
    static constexpr std::array<unsigned char, 9> kOurs = {8, 'h', 't', 't', 'p', '/', '1', '.', '1'};
    unsigned char* match = nullptr;
    const int found =
        ::SSL_select_next_proto(&match, chosenSize, kOurs.data(), kOurs.size(), offered, offeredSize);
    *chosen = match;
    return found == OPENSSL_NPN_NEGOTIATED ? SSL_TLSEXT_ERR_OK : SSL_TLSEXT_ERR_ALERT_FATAL;
}

boost::asio::const_buffer bytesOf(const std::string& text) { return boost::asio::buffer(text); }

/// The first failure ends it.
boost::system::error_code fill(ssl::context& context, const security::TlsIdentity& identity) {
    boost::system::error_code error;
    context.use_certificate_chain(bytesOf(identity.pem), error);
    if (!error) context.use_private_key(bytesOf(identity.pem), ssl::context::pem, error);
    if (error || identity.clientCas.empty()) return error;
    context.add_certificate_authority(bytesOf(identity.clientCas), error);
    if (!error) context.set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert, error);
    return error;
}

}  // namespace

Result<std::shared_ptr<ssl::context>> makeTlsContext(const security::TlsIdentity& identity) {
    auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
    SSL_CTX* native = context->native_handle();
    ::SSL_CTX_set_min_proto_version(native, TLS1_2_VERSION);
    ::SSL_CTX_set_options(native, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_NO_TICKET);
    ::SSL_CTX_set_session_cache_mode(native, SSL_SESS_CACHE_OFF);
    ::SSL_CTX_set_alpn_select_cb(native, chooseProtocol, nullptr);
    if (const auto error = fill(*context, identity); error) {
        return fail(ErrorCode::kMalformedFile, "the TLS files cannot be used for HTTP: " + error.message());
    }
    return context;
}

}  // namespace shapedb::http
