// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/security/certificate.h"

#include <chrono>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/self_signed.h"
#include "tests/support/temporary_directory.h"

namespace shapedb::security {
namespace {

using testing::selfSigned;

class CertificateTest : public ::testing::Test {
  protected:
    std::string write(const std::string& name, const std::string& content) {
        const std::string path = directory_.path() + "/" + name;
        std::ofstream(path) << content;
        return path;
    }
    void expectRefused(const TlsFiles& files, ErrorCode code, const std::string& word) {
        const auto loaded = loadTlsIdentity(files, now());
        ASSERT_FALSE(loaded) << word;
        EXPECT_EQ(loaded.error().code, code) << loaded.error().message;
        EXPECT_NE(loaded.error().message.find(word), std::string::npos) << loaded.error().message;
        EXPECT_EQ(loaded.error().message.find("PRIVATE KEY"), std::string::npos) << "tells no secret";
    }
    static UnixMs now() {
        const auto since = std::chrono::system_clock::now().time_since_epoch();
        return std::chrono::duration_cast<std::chrono::milliseconds>(since).count();
    }

    testing::TemporaryDirectory directory_;
    testing::PemPair pair_ = selfSigned("shapes.example");
    TlsFiles files_{write("cert.pem", pair_.certificate), write("key.pem", pair_.key), ""};
};

TEST_F(CertificateTest, LoadsAPair) {
    ::chmod(files_.key.c_str(), 0600);
    const auto loaded = loadTlsIdentity(files_, now());
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->subject, "CN=shapes.example");
    EXPECT_NEAR(static_cast<double>(loaded->notAfter - now()), 3'600'000.0, 10'000.0);
    EXPECT_NE(loaded->pem.find(pair_.key), std::string::npos);
    EXPECT_NE(loaded->pem.find(pair_.certificate), std::string::npos);
    EXPECT_TRUE(loaded->clientCas.empty());
    EXPECT_FALSE(loaded->keyIsReadableByOthers);
    ::chmod(files_.key.c_str(), 0644);
    EXPECT_TRUE(loadTlsIdentity(files_, now())->keyIsReadableByOthers);
}

TEST_F(CertificateTest, RefusesTheKeyOfAnotherCertificate) {
    files_.key = write("other.pem", selfSigned("shapes.example").key);
    expectRefused(files_, ErrorCode::kMalformedFile, "other.pem");
}

TEST_F(CertificateTest, RefusesWhatIsNotThere) {
    expectRefused({files_.certificate, "/nowhere/key.pem", ""}, ErrorCode::kFileNotReadable,
                  "/nowhere/key.pem");
    expectRefused({directory_.path(), files_.key, ""}, ErrorCode::kFileNotReadable, directory_.path());
    expectRefused({files_.key, files_.key, ""}, ErrorCode::kMalformedFile, "no certificate");
    expectRefused({files_.certificate, files_.certificate, ""}, ErrorCode::kMalformedFile, "no private key");
    expectRefused({write("empty.pem", ""), files_.key, ""}, ErrorCode::kMalformedFile, "empty.pem");
    expectRefused({files_.certificate, files_.key, files_.key}, ErrorCode::kMalformedFile, "key.pem");
    expectRefused({write("half.pem", pair_.certificate.substr(0, 200)), files_.key, ""},
                  ErrorCode::kMalformedFile, "half.pem");
}

TEST_F(CertificateTest, WaitsForNoPipeAndReadsNoEndlessFile) {
    const std::string pipe = directory_.path() + "/pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    expectRefused({files_.certificate, pipe, ""}, ErrorCode::kFileNotReadable, "not a regular file");
    expectRefused({"/dev/zero", files_.key, ""}, ErrorCode::kFileNotReadable, "not a regular file");
    expectRefused({write("huge.pem", std::string(std::size_t{2} << 20, 'x')), files_.key, ""},
                  ErrorCode::kMalformedFile, "huge.pem");
}

TEST_F(CertificateTest, RefusesWhatNoHandshakeWouldTake) {
    const auto weak = selfSigned("weak", -60, 3'600, 1'024);
    expectRefused({write("weak.pem", weak.certificate), write("weak.key", weak.key), ""},
                  ErrorCode::kMalformedFile, "cannot be used");
    const auto next = selfSigned("authority").certificate;
    expectRefused({write("cut.pem", pair_.certificate + next.substr(0, next.size() / 2)), files_.key, ""},
                  ErrorCode::kMalformedFile, "cannot be used");
    expectRefused({files_.certificate, files_.key, write("cas.pem", next + next.substr(0, next.size() / 2))},
                  ErrorCode::kMalformedFile, "certificate 2 is damaged");
    EXPECT_TRUE(loadTlsIdentity({write("chain.pem", pair_.certificate + next), files_.key, ""}, now()));
}

TEST_F(CertificateTest, AKeyFileMayHoldOldCertificates) {
    files_.key = write("both.pem", selfSigned("old").certificate + pair_.key);
    const auto loaded = loadTlsIdentity(files_, now());
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->pem.find(pair_.certificate), 0u) << "the right one comes first";
}

TEST_F(CertificateTest, RefusesAnEncryptedKeyWithoutAskingForAPassword) {
    files_.key = write("locked.pem",
                       "-----BEGIN ENCRYPTED PRIVATE KEY-----\nMIIBHDBXBgkqhkiG9w0BBQ0w\n"
                       "-----END ENCRYPTED PRIVATE KEY-----\n");
    const auto loaded = loadTlsIdentity(files_, now());
    ASSERT_FALSE(loaded);
    EXPECT_NE(loaded.error().message.find("encrypted"), std::string::npos) << loaded.error().message;
}

TEST_F(CertificateTest, RefusesWhatHasExpiredOrIsNotValidYet) {
    const auto late = selfSigned("late", -7'200, -3'600), early = selfSigned("early", 3'600, 7'200);
    expectRefused({write("late.pem", late.certificate), write("late.key", late.key), ""},
                  ErrorCode::kRejected, "expired on");
    expectRefused({write("early.pem", early.certificate), write("early.key", early.key), ""},
                  ErrorCode::kRejected, "not valid before");
}

TEST_F(CertificateTest, TakesTheAuthoritiesOfClients) {
    files_.clientCa = write("ca.pem", selfSigned("ca").certificate);
    EXPECT_FALSE(loadTlsIdentity(files_, now())->clientCas.empty());
}

}  // namespace
}  // namespace shapedb::security
