// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/certificate.h"

#include <ctime>
#include <memory>

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include "common/small_file.h"
#include "common/utc_text.h"
#include "core/base/return_if_error.h"

namespace shapedb::security {
namespace {

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
using PrivateKey = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

/// Far above any chain; a log file by mistake ends here.
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;

tl::unexpected<Error> malformed(const std::string& path, const std::string& why) {
    ERR_clear_error();
    return fail(ErrorCode::kMalformedFile, path + ": " + why);
}

Result<std::string> readFile(const std::string& path) {
    return readSmallFile("TLS file", path, kMaxFileBytes);
}

Bio readerOf(const std::string& text) {
    return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), BIO_free};
}

/// For an encrypted key: nobody is there to type a password.
int noPassword(char*, int, int, void*) { return 0; }

Result<PrivateKey> parseKey(const std::string& path, const std::string& pem) {
    const Bio bio = readerOf(pem);
    PrivateKey key(PEM_read_bio_PrivateKey(bio.get(), nullptr, noPassword, nullptr), EVP_PKEY_free);
    if (key) return key;
    const bool encrypted = pem.find("ENCRYPTED") != std::string::npos;
    return malformed(
        path, encrypted ? "the key is encrypted: give one without a password, readable by the server only"
                        : "there is no private key in PEM form");
}

Result<Certificate> parseCertificate(const std::string& path, const std::string& pem) {
    const Bio bio = readerOf(pem);
    Certificate certificate(PEM_read_bio_X509_AUX(bio.get(), nullptr, nullptr, nullptr), X509_free);
    if (certificate) return certificate;
    return malformed(path, "there is no certificate in PEM form");
}

UnixMs timeOf(const ASN1_TIME* time) {
    std::tm parts{};
    if (ASN1_TIME_to_tm(time, &parts) != 1) return 0;
    return static_cast<UnixMs>(timegm(&parts)) * 1'000;
}

std::string dateOf(UnixMs time) { return utcText(time / 1'000, "%Y-%m-%d %H:%M UTC"); }

std::string subjectOf(const X509& certificate) {
    const Bio bio(BIO_new(BIO_s_mem()), BIO_free);
    X509_NAME_print_ex(bio.get(), X509_get_subject_name(&certificate), 0, XN_FLAG_RFC2253);
    char* data = nullptr;
    const auto size = BIO_get_mem_data(bio.get(), &data);
    return {data, static_cast<std::size_t>(size)};
}

Result<void> requireValidAt(const std::string& path, const X509& certificate, UnixMs now) {
    const UnixMs begin = timeOf(X509_get0_notBefore(&certificate));
    const UnixMs end = timeOf(X509_get0_notAfter(&certificate));
    if (now >= end) {
        return fail(ErrorCode::kRejected, path + ": the certificate expired on " + dateOf(end));
    }
    if (now < begin) {
        return fail(ErrorCode::kRejected, path + ": the certificate is not valid before " + dateOf(begin) +
                                              "; is the clock right?");
    }
    return {};
}

/// Reads key and chain as the TLS library of gRPC does, with its rules for their strength: what it would
/// refuse at each handshake is refused here.
Result<void> requireUsable(const std::string& path, const std::string& pem) {
    const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_server_method()),
                                                                    SSL_CTX_free);
    const auto refused = [&] {
        const unsigned long code = ERR_peek_last_error();
        const char* reason = code == 0 ? nullptr : ERR_reason_error_string(code);
        return malformed(path, std::string("certificate and key cannot be used: ") +
                                   (reason == nullptr ? "unknown reason" : reason));
    };
    const Bio chain = readerOf(pem);
    const Certificate leaf(PEM_read_bio_X509_AUX(chain.get(), nullptr, nullptr, nullptr), X509_free);
    if (!context || !leaf || SSL_CTX_use_certificate(context.get(), leaf.get()) != 1) return refused();
    ERR_clear_error();
    while (X509* next = PEM_read_bio_X509(chain.get(), nullptr, nullptr, nullptr)) {
        // Owned by the context from here on.
        if (SSL_CTX_add_extra_chain_cert(context.get(), next) != 1) {
            X509_free(next);
            return refused();
        }
    }
    // The end of the text, or a certificate that was cut short.
    if (ERR_GET_REASON(ERR_peek_last_error()) != PEM_R_NO_START_LINE) return refused();
    ERR_clear_error();
    const Bio keyText = readerOf(pem);
    const PrivateKey key(PEM_read_bio_PrivateKey(keyText.get(), nullptr, noPassword, nullptr), EVP_PKEY_free);
    if (!key || SSL_CTX_use_PrivateKey(context.get(), key.get()) != 1 ||
        SSL_CTX_check_private_key(context.get()) != 1) {
        return refused();
    }
    return {};
}

/// All of the file, not only what stands before a mistake. Errors: kMalformedFile.
Result<void> requireCertificates(const std::string& path, const std::string& pem) {
    const Bio all = readerOf(pem);
    int count = 0;
    while (X509* one = PEM_read_bio_X509_AUX(all.get(), nullptr, nullptr, nullptr)) {
        X509_free(one);
        ++count;
    }
    if (count > 0 && ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE) {
        ERR_clear_error();
        return {};
    }
    return malformed(path, count == 0 ? "there is no certificate in PEM form"
                                      : "certificate " + std::to_string(count + 1) + " is damaged");
}

bool othersCanRead(const std::string& path) {
    struct stat status {};
    return ::stat(path.c_str(), &status) == 0 && (status.st_mode & S_IROTH) != 0;
}

}  // namespace

Result<TlsIdentity> loadTlsIdentity(const TlsFiles& files, UnixMs now) {
    const auto certificatePem = readFile(files.certificate);
    RETURN_IF_ERROR(certificatePem);
    const auto keyPem = readFile(files.key);
    RETURN_IF_ERROR(keyPem);
    const auto certificate = parseCertificate(files.certificate, *certificatePem);
    RETURN_IF_ERROR(certificate);
    const auto key = parseKey(files.key, *keyPem);
    RETURN_IF_ERROR(key);
    if (X509_check_private_key(certificate->get(), key->get()) != 1) {
        return malformed(files.key, "this key does not belong to " + files.certificate);
    }
    RETURN_IF_ERROR(requireValidAt(files.certificate, **certificate, now));
    TlsIdentity identity;
    // The certificates first, for a key file may hold some as well.
    identity.pem = *certificatePem + "\n" + *keyPem;
    RETURN_IF_ERROR(requireUsable(files.certificate, identity.pem));
    identity.subject = subjectOf(**certificate);
    identity.notAfter = timeOf(X509_get0_notAfter(certificate->get()));
    identity.keyIsReadableByOthers = othersCanRead(files.key);
    if (files.clientCa.empty()) return identity;
    auto cas = readFile(files.clientCa);
    RETURN_IF_ERROR(cas);
    RETURN_IF_ERROR(requireCertificates(files.clientCa, *cas));
    identity.clientCas = std::move(*cas);
    return identity;
}

}  // namespace shapedb::security
