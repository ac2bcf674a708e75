#include "server/security/certificate.h"

#include <array>
#include <cerrno>
#include <ctime>
#include <fstream>
#include <iterator>
#include <memory>
#include <system_error>

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>

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
    errno = 0;
    std::ifstream stream(path, std::ios::binary);
    std::string text;
    try {
        text.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    } catch (const std::ios_base::failure&) {
        stream.setstate(std::ios::badbit);  // a folder
    }
    if (!stream.is_open() || stream.bad()) {
        const std::string why = errno == 0 ? "cannot be read" : std::generic_category().message(errno);
        return fail(ErrorCode::kFileNotReadable, path + ": " + why);
    }
    if (text.size() > kMaxFileBytes) return malformed(path, "too large for a PEM file");
    return text;
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

std::string dateOf(UnixMs time) {
    const auto seconds = static_cast<std::time_t>(time / 1'000);
    std::tm parts{};
    gmtime_r(&seconds, &parts);
    std::array<char, 32> text{};
    std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &parts);
    return text.data();
}

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
        return malformed(files.key, "this is the key of another certificate than " + files.certificate);
    }
    RETURN_IF_ERROR(requireValidAt(files.certificate, **certificate, now));
    TlsIdentity identity;
    identity.pem = *keyPem + "\n" + *certificatePem;
    identity.subject = subjectOf(**certificate);
    identity.notAfter = timeOf(X509_get0_notAfter(certificate->get()));
    identity.keyIsReadableByOthers = othersCanRead(files.key);
    if (files.clientCa.empty()) return identity;
    auto cas = readFile(files.clientCa);
    RETURN_IF_ERROR(cas);
    RETURN_IF_ERROR(parseCertificate(files.clientCa, *cas));
    identity.clientCas = std::move(*cas);
    return identity;
}

}  // namespace shapedb::security
