// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the files that an operator gives the server: configuration, certificates, keys. The first byte
// chooses.
#include "server/config/load.h"
#include "server/security/certificate.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

namespace {

void tryConfiguration(const std::string& text) {
    config::CommandLine commandLine;
    commandLine.configFile = fuzz::writeFile(".toml", text);
    const auto loaded = config::load(commandLine, {});
    if (fuzz::valueOrExplained(loaded) == nullptr) return;
    commandLine.configFile = fuzz::writeFile(".again.toml", config::describe(*loaded));
    const auto again = config::load(commandLine, {});
    require(static_cast<bool>(again), "what is printed can be read");
    require(again->config.limits.maxK == loaded->config.limits.maxK, "and means the same");
    require(again->config.data == loaded->config.data, "and means the same");
}

void tryCertificate(const std::string& text) {
    const std::string path = fuzz::writeFile(".pem", text);
    constexpr security::UnixMs kNow = 1'800'000'000'000;
    static_cast<void>(fuzz::valueOrExplained(security::loadTlsIdentity({path, path, path}, kNow)));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    const bool configuration = input.byte() % 2 == 0;
    const std::string text = input.rest();
    if (configuration) {
        tryConfiguration(text);
    } else {
        tryCertificate(text);
    }
    return 0;
}
