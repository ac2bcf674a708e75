// SPDX-License-Identifier: GPL-3.0-or-later
#include <faiss/Index.h>
#include <faiss/IndexFlat.h>

#include "bench/peers.h"

namespace shapedb::bench {

namespace {

class FaissScan : public VectorScan {
  public:
    explicit FaissScan(std::size_t dimension) : index_(static_cast<faiss::Index::idx_t>(dimension)) {}

    void add(const float* vectors, std::size_t count) override {
        index_.add(static_cast<faiss::Index::idx_t>(count), vectors);
    }

    std::vector<long> nearest(const float* query, std::size_t k) const override {
        std::vector<faiss::Index::idx_t> ids(k);
        std::vector<float> distances(k);
        index_.search(1, query, static_cast<faiss::Index::idx_t>(k), distances.data(), ids.data());
        return {ids.begin(), ids.end()};
    }

  private:
    faiss::IndexFlatL2 index_;
};

}  // namespace

std::unique_ptr<VectorScan> makeVectorScan(std::size_t dimension) {
    return std::make_unique<FaissScan>(dimension);
}

std::string vectorScanName() {
    return "FAISS " + std::to_string(FAISS_VERSION_MAJOR) + "." + std::to_string(FAISS_VERSION_MINOR) + "." +
           std::to_string(FAISS_VERSION_PATCH) + " IndexFlatL2";
}

}  // namespace shapedb::bench
