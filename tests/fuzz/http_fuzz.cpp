// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes what HTTP clients send: envelopes in any pieces, requests and their heads, and messages as JSON. The
// first byte chooses.
#include <nlohmann/json.hpp>

#include "server/http/envelope.h"
#include "server/http/failure.h"
#include "server/http/files.h"
#include "server/http/methods.h"
#include "server/http/request.h"
#include "server/http/request_parser.h"
#include "tests/fuzz/fuzz.h"

using namespace shapedb;
using fuzz::require;

namespace {

constexpr std::size_t kMostBytes = 200;

const http::Methods& methods() {
    static const http::Methods all;
    return all;
}

void requireExplained(const http::Failure& failure) {
    require(!failure.message.empty(), "failures have a message");
    require(failure.httpStatus() >= 400 && failure.httpStatus() < 600, "failures have a status of HTTP");
    require(nlohmann::json::accept(http::failureJson(failure)), "failures are JSON");
    require(nlohmann::json::accept(http::endOfStreamJson(&failure, {})), "failures are JSON");
}

void tryEnvelopes(fuzz::Input& input) {
    http::EnvelopeReader reader(kMostBytes);
    std::vector<std::string> messages;
    std::string sent;
    while (input.left() > 0) {
        const std::string piece = input.bytes(1 + input.byte() % 32);
        sent += piece;
        if (const auto added = reader.add(piece, messages); !added) return requireExplained(added.error());
    }
    std::string again;
    for (const std::string& message : messages) {
        require(message.size() <= kMostBytes, "no longer message than allowed");
        again += http::inEnvelope(http::kPlainMessage, message);
    }
    require(sent.compare(0, again.size(), again) == 0, "messages are what was sent");
    require(reader.between() == (again.size() == sent.size()), "what is cut off is noticed");
}

void tryHead(fuzz::Input& input) {
    constexpr const char* kNames[] = {"host",
                                      "origin",
                                      "content-type",
                                      "content-length",
                                      "content-encoding",
                                      "transfer-encoding",
                                      "authorization",
                                      "traceparent",
                                      "connect-timeout-ms",
                                      "accept-encoding",
                                      "if-none-match",
                                      "connect-protocol-version"};
    http::Head head;
    head.method = "POST";
    head.version = input.byte() % 8 == 0 ? input.byte() : 11;
    head.target = input.bytes(input.byte() % 64);
    while (input.left() > 0) {
        const char* name = kNames[input.byte() % std::size(kNames)];
        head.fields.emplace_back(name, input.bytes(input.byte() % 64));
    }
    const auto hosts = http::Hosts::named({"shapes.example"});
    if (const auto good = http::checkHead(head, hosts); !good) return requireExplained(good.error());
    require(hosts.allow(head.field("host")), "the name is one of ours");
    static_cast<void>(http::fileResponse(head, http::embeddedFiles()));
    const auto form = http::formOf(head, *methods().find("/shapedb.v1.ShapeService/GetShape"));
    if (!form) return requireExplained(form.error());
    for (const char c : form->authorization + form->traceparent) {
        require(c >= 0x20 && c <= 0x7e, "gRPC gets what it takes");
    }
}

void tryJson(fuzz::Input& input) {
    constexpr const char* kPaths[] = {
        "/shapedb.v1.ShapeService/AddShape",       "/shapedb.v1.SearchService/SearchBatch",
        "/shapedb.v1.AdminService/CreateKey",      "/shapedb.v1.CollectionService/CreateCollection",
        "/shapedb.v1.ShapeService/UpdateMetadata", "/shapedb.v1.AlignService/Align",
    };
    http::Method method = *methods().find(kPaths[input.byte() % std::size(kPaths)]);
    const auto bytes = methods().requestFromJson(method, input.rest());
    if (!bytes) return requireExplained(bytes.error());
    method.responseType = method.requestType;
    const auto json = methods().responseToJson(method, *bytes);
    require(static_cast<bool>(json), "what was read can be written");
    const auto again = methods().requestFromJson(method, *json);
    require(static_cast<bool>(again), "what was written can be read");
    require(*methods().responseToJson(method, *again) == *json, "and means the same");
}

/// As Connection does, in pieces: requests one after another until the bytes end or make no sense.
void tryRequests(fuzz::Input& input) {
    http::RequestParser parser;
    const auto hosts = http::Hosts::named({});
    std::size_t sent = 0;
    std::size_t received = 0;
    parser.begin();
    while (input.left() > 0) {
        const std::string piece = input.bytes(1 + input.byte());
        sent += piece.size();
        parser.add(piece);
        while (true) {
            const bool hadHead = parser.headDone();
            const auto step = parser.step();
            if (step == http::RequestParser::Step::kBad) return requireExplained(parser.problem());
            if (step == http::RequestParser::Step::kTooLittle) break;
            if (!hadHead && parser.headDone()) {
                if (const auto good = http::checkHead(parser.head(), hosts); !good)
                    return requireExplained(good.error());
                parser.onBody([&](std::string_view bytes) { received += bytes.size(); });
            }
            if (parser.done()) parser.begin();
        }
        require(received + parser.waiting() <= sent, "a body holds no more than was sent");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    const int kind = input.byte() % 4;
    if (kind == 0) tryEnvelopes(input);
    if (kind == 1) tryHead(input);
    if (kind == 2) tryJson(input);
    if (kind == 3) tryRequests(input);
    return 0;
}
