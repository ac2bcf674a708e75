// SPDX-License-Identifier: Apache-2.0
// What a program that uses the installed library looks like: prints why a server cannot be reached.
#include <iostream>

#include "client/api/client.h"

int main() {
    shapedb::client::ClientOptions options;
    options.address = "127.0.0.1:1";
    options.retry.maxAttempts = 1;
    const auto client = shapedb::client::Client::connect(options);
    if (!client) return 1;
    const auto shape = client->getShape({"", "cup"});
    if (shape) return 1;
    std::cout << shapedb::errorCodeName(shape.error().code) << "\n";
}
