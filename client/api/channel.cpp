// SPDX-License-Identifier: Apache-2.0
#include "client/api/channel.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>

#include <arpa/inet.h>
#include <grpcpp/create_channel.h>

#include "client/api/client.h"
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

namespace {

/// What gRPC resolves by itself.
constexpr std::array<const char*, 6> kSchemes = {
    "unix:", "unix-abstract:", "dns:", "ipv4:", "ipv6:", "vsock:"};

bool beginsWith(const std::string& text, const std::string& beginning) {
    return text.compare(0, beginning.size(), beginning) == 0;
}

tl::unexpected<Error> refused(const std::string& address, const std::string& why) {
    return fail(ErrorCode::kInvalidArgument,
                "'" + address + "' is no address of a server: " + why +
                    "; give HOST:PORT, for example 127.0.0.1:" + std::to_string(kDefaultPort));
}

/// A number from 1 to 65535 in plain digits.
bool isPort(const std::string& text) {
    if (text.empty() || text.size() > 5) return false;
    if (!std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; }))
        return false;
    const int port = std::stoi(text);
    return port >= 1 && port <= 65535;
}

Result<std::string> withPort(const std::string& address, const std::string& host, const std::string& port) {
    if (host.empty() || host == "[]") return refused(address, "it has no host");
    if (port.empty()) return refused(address, "it has no port after the colon");
    if (!isPort(port)) return refused(address, "'" + port + "' is not a port (1 to 65535)");
    return host + ":" + port;
}

}  // namespace

Result<std::string> checkedAddress(const std::string& address) {
    if (address.empty())
        return fail(ErrorCode::kInvalidArgument, "the server's address is empty; give HOST:PORT");
    const bool odd =
        std::any_of(address.begin(), address.end(), [](unsigned char c) { return c <= ' ' || c == 0x7f; });
    if (beginsWith(address, "http://") || beginsWith(address, "https://")) {
        return refused(address, std::string("that is a web address; the API has another port") +
                                    (beginsWith(address, "https") ? " (TLS is switched on apart)" : ""));
    }
    for (const std::string scheme : kSchemes) {
        if (!beginsWith(address, scheme)) continue;
        if (address.size() == scheme.size()) return refused(address, "nothing follows " + scheme);
        return address;
    }
    if (odd) return refused(address, "it has a blank or control character");
    if (const auto scheme = address.find("://"); scheme != std::string::npos) {
        return refused(address, "nobody knows how to reach " + address.substr(0, scheme + 3));
    }
    if (address.find_first_of("/@?#") != std::string::npos) {
        return refused(address, "it has more than a host and a port");
    }
    const std::string port = std::to_string(kDefaultPort);
    if (address.front() == '[') {
        const auto end = address.find(']');
        if (end == std::string::npos) return refused(address, "a ] is missing");
        const std::string host = address.substr(0, end + 1);
        if (end + 1 == address.size()) return withPort(address, host, port);
        if (address[end + 1] != ':') return refused(address, "after ] comes a colon and the port");
        return withPort(address, host, address.substr(end + 2));
    }
    const auto colon = address.find(':');
    if (colon == std::string::npos) return withPort(address, address, port);
    if (address.find(':', colon + 1) == std::string::npos) {
        return withPort(address, address.substr(0, colon), address.substr(colon + 1));
    }
    if (address.find_first_not_of("0123456789abcdefABCDEF:.") < address.find('%')) {
        return refused(address, "it has more than one colon");
    }
    return "[" + address + "]:" + port;  // a bare IPv6 address
}

}  // namespace shapedb::client
