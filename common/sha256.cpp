#include "common/sha256.h"

#include <new>

#include <openssl/evp.h>

namespace shapedb {

namespace {

// OpenSSL's digest calls fail for want of memory only: the algorithm is always built in.
void require(int ok) {
    if (ok != 1) throw std::bad_alloc();
}

// Looked up once: EVP_sha256() is searched for by name at each use, which takes as long as hashing some
// hundred bytes.
const EVP_MD* algorithm() {
    static const EVP_MD* const found = EVP_MD_fetch(nullptr, "SHA256", nullptr);
    return found != nullptr ? found : EVP_sha256();
}

}  // namespace

struct Sha256::Context {
    Context() : evp(EVP_MD_CTX_new()) {
        if (evp == nullptr) throw std::bad_alloc();
    }
    ~Context() { EVP_MD_CTX_free(evp); }
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    EVP_MD_CTX* evp;
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {
    require(EVP_DigestInit_ex(context_->evp, algorithm(), nullptr));
}

Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

void Sha256::update(const void* data, std::size_t size) {
    if (size > 0) require(EVP_DigestUpdate(context_->evp, data, size));
}

Sha256Digest Sha256::finish() {
    Sha256Digest digest{};
    require(EVP_DigestFinal_ex(context_->evp, digest.data(), nullptr));
    require(EVP_DigestInit_ex(context_->evp, algorithm(), nullptr));
    return digest;
}

Sha256Digest sha256(const void* data, std::size_t size) {
    Sha256Digest digest{};
    require(EVP_Digest(size > 0 ? data : "", size, digest.data(), nullptr, algorithm(), nullptr));
    return digest;
}

std::string toHex(const Sha256Digest& digest) {
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string text;
    text.reserve(2 * digest.size());
    for (const std::uint8_t byte : digest) {
        text.push_back(kDigits[byte >> 4]);
        text.push_back(kDigits[byte & 15]);
    }
    return text;
}

}  // namespace shapedb
