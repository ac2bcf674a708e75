// SPDX-License-Identifier: Apache-2.0
// Stores a scan, then finds the shapes most like it. Usage: quick [HOST:PORT]
#include <cmath>
#include <cstdio>

#include "client/api/client.h"

namespace {

/// A dumbbell: two balls on a rod, as a scanner would see it.
shapedb::PointCloud dumbbell() {
    shapedb::PointCloud points;
    constexpr int kCount = 6000;
    for (int i = 0; i < kCount; ++i) {  // evenly spread directions: a Fibonacci spiral
        const double z = 1.0 - 2.0 * (i + 0.5) / kCount;
        const double angle = 2.399963229728653 * i;
        const double radius = std::sqrt(1.0 - z * z);
        const double x = radius * std::cos(angle);
        const double y = radius * std::sin(angle);
        if (x < 0.95) points.push_back({x - 1.5, y, z});
        if (x > -0.95) points.push_back({x + 1.5, y, z});
    }
    for (int i = 0; i < 400; ++i) {
        const double angle = 2.399963229728653 * i;
        points.push_back({-0.55 + 1.1 * i / 400.0, 0.3 * std::cos(angle), 0.3 * std::sin(angle)});
    }
    return points;
}

int complain(const shapedb::Error& error) {
    std::fprintf(stderr, "%s: %s\n", shapedb::errorCodeName(error.code), error.message.c_str());
    return 1;
}

}  // namespace

int main(int argc, char** argv) {
    using namespace shapedb::client;
    ClientOptions options;
    if (argc > 1) options.address = argv[1];
    const auto client = Client::connect(options);
    if (!client) return complain(client.error());

    AddRequest request;
    request.shape.key = "dumbbell";
    request.metadata = Metadata{{"label", "example"}};
    request.wait = true;  // until it is segmented and can be found
    const auto added = client->addShape(request, dumbbell());
    if (!added) return complain(added.error());
    std::printf("%s: %s, version %lld\n", added->shape.key.c_str(), outcomeName(added->outcome),
                static_cast<long long>(added->shape.version));

    SearchOptions search;
    search.k = 5;
    const auto found = client->searchByScan(search, dumbbell());
    if (!found) return complain(found.error());
    for (const Hit& hit : found->hits) std::printf("%.3f  %s\n", hit.score, hit.shape.key.c_str());
    return 0;
}
