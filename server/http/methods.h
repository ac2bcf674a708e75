// SPDX-License-Identifier: GPL-3.0-or-later
// Which calls there are, and their messages as JSON and as protobuf.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "server/http/failure.h"

namespace google::protobuf::util {
class TypeResolver;
}

namespace shapedb::http {

struct Method {
    std::string path;         ///< "/shapedb.v1.ShapeService/GetShape", as gRPC has it too
    std::string requestType;  ///< "shapedb.v1.GetShapeRequest"
    std::string responseType;
    bool clientStreams = false;
    bool serverStreams = false;

    [[nodiscard]] bool streams() const { return clientStreams || serverStreams; }
};

/// All methods of the API. Thread-safe.
class Methods {
  public:
    Methods();
    ~Methods();

    /// Null if there is none.
    [[nodiscard]] const Method* find(std::string_view path) const;
    /// Whether the path is one of a service's, be there such a method or not.
    [[nodiscard]] static bool isCall(std::string_view path);

    /// A message of the method as protobuf. Fails with the place if the text is no JSON, or not such a
    /// message; unknown fields are refused.
    [[nodiscard]] OrFailure<std::string> requestFromJson(const Method& method, std::string_view json) const;
    /// An answer of the method, from the protobuf of a handler of ours.
    [[nodiscard]] OrFailure<std::string> responseToJson(const Method& method, const std::string& bytes) const;

  private:
    std::map<std::string, Method, std::less<>> methods_;
    std::unique_ptr<google::protobuf::util::TypeResolver> types_;
};

}  // namespace shapedb::http
