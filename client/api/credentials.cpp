// SPDX-License-Identifier: Apache-2.0
#include "client/api/credentials.h"

#include <cstdlib>

#include <arpa/inet.h>
#include <grpcpp/create_channel.h>

#include "common/small_file.h"
#include "core/base/return_if_error.h"

namespace shapedb::client {

namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;

std::string fromEnvironment(const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? std::string() : value;
}

bool startsWith(const std::string& text, const std::string& prefix) {
    return text.compare(0, prefix.size(), prefix) == 0;
}

Result<std::string> readOptional(const char* what, const std::string& path) {
    return path.empty() ? Result<std::string>(std::string()) : readSmallFile(what, path, kMaxFileBytes);
}

}  // namespace

ClientOptions optionsFromEnvironment() {
    ClientOptions options;
    const std::string server = fromEnvironment("SHAPEDB_SERVER");
    if (!server.empty()) options.address = server;
    options.apiKey = fromEnvironment("SHAPEDB_API_KEY");
    options.apiKeyFile = fromEnvironment("SHAPEDB_API_KEY_FILE");
    options.tls.caFile = fromEnvironment("SHAPEDB_TLS_CA");
    options.tls.certificateFile = fromEnvironment("SHAPEDB_CLIENT_CERTIFICATE");
    options.tls.keyFile = fromEnvironment("SHAPEDB_CLIENT_KEY");
    const std::string tls = fromEnvironment("SHAPEDB_TLS");
    options.tls.enabled = (!tls.empty() && tls != "0") || !options.tls.caFile.empty();
    return options;
}

bool isThisMachine(const std::string& address) {
    for (const char* local : {"unix:", "unix-abstract:", "localhost:", "[::1]:"}) {
        if (startsWith(address, local)) return true;
    }
    // A name may begin like an address: 127.example.org.
    in_addr v4{};
    const std::string host = address.substr(0, address.rfind(':'));
    return ::inet_pton(AF_INET, host.c_str(), &v4) == 1 && (ntohl(v4.s_addr) >> 24) == 127;
}

Result<std::string> apiKeyOf(const ClientOptions& options) {
    std::string key = options.apiKey;
    if (key.empty() && !options.apiKeyFile.empty()) {
        auto text = readSmallFile("API key file", options.apiKeyFile, kMaxFileBytes);
        RETURN_IF_ERROR(text);
        key = text->substr(0, text->find_first_of("\r\n"));
        if (key.empty()) {
            return fail(ErrorCode::kInvalidArgument,
                        "API key file " + options.apiKeyFile + " has no key in its first line");
        }
    }
    // gRPC would end the process on metadata that HTTP does not allow.
    for (const char c : key) {
        if (c <= ' ' || c > '~') {
            return fail(ErrorCode::kInvalidArgument, "the API key has a character that no key has");
        }
    }
    if (!key.empty() && !options.tls.enabled && !isThisMachine(options.address)) {
        return fail(ErrorCode::kInvalidArgument,
                    "the API key would travel unprotected to " + options.address + ": use TLS");
    }
    return key;
}

Result<std::shared_ptr<grpc::ChannelCredentials>> channelCredentials(const TlsOptions& tls,
                                                                     grpc::ChannelArguments& arguments) {
    const bool files = !tls.caFile.empty() || !tls.certificateFile.empty() || !tls.keyFile.empty();
    if (!tls.enabled) {
        // A proxy that the environment names would read all that is said, the key too.
        arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
        if (!files) return grpc::InsecureChannelCredentials();
        return fail(ErrorCode::kInvalidArgument, "there are files for TLS, but TLS is not enabled");
    }
    if (tls.certificateFile.empty() != tls.keyFile.empty()) {
        return fail(ErrorCode::kInvalidArgument,
                    "the client's certificate and its key belong together: give both or neither");
    }
    grpc::SslCredentialsOptions options;
    auto roots = readOptional("CA file", tls.caFile);
    RETURN_IF_ERROR(roots);
    auto certificate = readOptional("certificate file", tls.certificateFile);
    RETURN_IF_ERROR(certificate);
    auto key = readOptional("key file", tls.keyFile);
    RETURN_IF_ERROR(key);
    options.pem_root_certs = std::move(*roots);
    options.pem_cert_chain = std::move(*certificate);
    options.pem_private_key = std::move(*key);
    if (!tls.serverName.empty()) arguments.SetSslTargetNameOverride(tls.serverName);
    return grpc::SslCredentials(options);
}

}  // namespace shapedb::client
