// SPDX-License-Identifier: GPL-3.0-or-later
// What the head of a request asks for, and whether it may: before any of its body is read.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/http/failure.h"
#include "server/http/methods.h"

namespace shapedb::http {

/// The head as it came, its field names in lower case.
struct Head {
    std::string method;  ///< "GET"
    std::string target;
    int version = 11;  ///< 10 * major + minor
    std::vector<std::pair<std::string, std::string>> fields;

    /// The first field of that name; empty if there is none.
    [[nodiscard]] std::string_view field(std::string_view name) const;
    [[nodiscard]] std::size_t count(std::string_view name) const;
    /// The target without its query.
    [[nodiscard]] std::string_view path() const;
};

/// Under which names this server may be asked. Without them a page of a stranger could have its name lead to
/// this machine (DNS rebinding), and its browser would then take us for the page's own server.
class Hosts {
  public:
    /// Any name: for servers that ask for keys, which no such page has.
    static Hosts any() { return Hosts(true, {}); }
    /// IP addresses, "localhost", and these names; case does not matter.
    static Hosts named(std::vector<std::string> names) { return Hosts(false, std::move(names)); }

    /// `authority`: NAME, NAME:PORT, [IPV6]:PORT.
    [[nodiscard]] bool allow(std::string_view authority) const;

  private:
    Hosts(bool any, std::vector<std::string> names);
    bool any_;
    std::vector<std::string> names_;
};

/// What every request has to keep to, whatever it asks for. Fails with a status of its own.
[[nodiscard]] OrFailure<void> checkHead(const Head& head, const Hosts& hosts);

/// How a call sends and wants its messages.
struct CallForm {
    bool json = false;
    bool enveloped = false;
    std::optional<std::chrono::milliseconds> timeout;
    std::string authorization;  ///< empty: none
    std::string traceparent;    ///< empty: none

    [[nodiscard]] const char* contentType() const;
};

/// Fails if the call cannot be made in this form, or a page of another site makes it.
[[nodiscard]] OrFailure<CallForm> formOf(const Head& head, const Method& method);

}  // namespace shapedb::http
