// SPDX-License-Identifier: GPL-3.0-or-later
// Certificates for tests.
#pragma once

#include <string>

#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rsa.h>
#include <openssl/x509.h>

namespace shapedb::testing {

struct PemPair {
    std::string key;
    std::string certificate;
};

/// A self-signed certificate valid from `begin` to `end`, seconds from now. `rsaBits` 0: elliptic.
inline PemPair selfSigned(const char* name, long begin = -60, long end = 3'600, unsigned rsaBits = 0) {
    EVP_PKEY* key = rsaBits == 0 ? EVP_EC_gen("P-256") : EVP_RSA_gen(rsaBits);
    X509* certificate = X509_new();
    ASN1_INTEGER_set(X509_get_serialNumber(certificate), 1);
    X509_gmtime_adj(X509_getm_notBefore(certificate), begin);
    X509_gmtime_adj(X509_getm_notAfter(certificate), end);
    X509_set_pubkey(certificate, key);
    X509_NAME* subject = X509_get_subject_name(certificate);
    X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>(name), -1,
                               -1, 0);
    X509_set_issuer_name(certificate, subject);
    X509_sign(certificate, key, EVP_sha256());
    const auto text = [](auto write) {
        BIO* bio = BIO_new(BIO_s_mem());
        write(bio);
        char* data = nullptr;
        const auto size = BIO_get_mem_data(bio, &data);
        std::string pem(data, static_cast<std::size_t>(size));
        BIO_free(bio);
        return pem;
    };
    PemPair pair;
    pair.key =
        text([&](BIO* bio) { PEM_write_bio_PrivateKey(bio, key, nullptr, nullptr, 0, nullptr, nullptr); });
    pair.certificate = text([&](BIO* bio) { PEM_write_bio_X509(bio, certificate); });
    X509_free(certificate);
    EVP_PKEY_free(key);
    return pair;
}

}  // namespace shapedb::testing
