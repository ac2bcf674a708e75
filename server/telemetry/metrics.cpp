// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/telemetry/metrics.h"

#include <exception>
#include <mutex>

#include <prometheus/counter.h>
#include <prometheus/exposer.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

namespace shapedb::telemetry {
namespace {

/// From the quickest reads to the largest uploads.
const prometheus::Histogram::BucketBoundaries kCallSeconds = {0.001, 0.003, 0.01, 0.03, 0.1,  0.3,
                                                              1.0,   3.0,   10.0, 30.0, 100.0};

/// Each may be held by a client that says nothing, or reads nothing, but not for long.
constexpr const char* kHttpThreads = "16";
constexpr const char* kHttpTimeoutMs = "2000";

prometheus::ClientMetric metricOf(const Sample& sample) {
    prometheus::ClientMetric metric;
    for (const auto& [name, value] : sample.labels) metric.label.push_back({name, value});
    if (sample.kind == Sample::Kind::kCounter) {
        metric.counter.value = sample.value;
    } else {
        metric.gauge.value = sample.value;
    }
    return metric;
}

/// Samples of one name become one family, as the format wants it.
std::vector<prometheus::MetricFamily> familiesOf(const std::vector<Sample>& samples) {
    std::vector<prometheus::MetricFamily> families;
    for (const Sample& sample : samples) {
        if (families.empty() || families.back().name != sample.name) {
            const bool counter = sample.kind == Sample::Kind::kCounter;
            families.push_back({sample.name,
                                sample.help,
                                counter ? prometheus::MetricType::Counter : prometheus::MetricType::Gauge,
                                {}});
        }
        families.back().metric.push_back(metricOf(sample));
    }
    return families;
}

/// What is asked for at the moment of a scrape.
class SampledState final : public prometheus::Collectable {
  public:
    explicit SampledState(Sampler sampler) : sampler_(std::move(sampler)) {}
    std::vector<prometheus::MetricFamily> Collect() const override { return familiesOf(sampler_()); }

  private:
    const Sampler sampler_;
};

}  // namespace

struct Metrics::Parts {
    std::shared_ptr<prometheus::Registry> registry = std::make_shared<prometheus::Registry>();
    prometheus::Family<prometheus::Counter>& calls = prometheus::BuildCounter()
                                                         .Name("shapedb_calls_total")
                                                         .Help("Calls that have ended, by rpc and gRPC code.")
                                                         .Register(*registry);
    prometheus::Family<prometheus::Histogram>& seconds =
        prometheus::BuildHistogram()
            .Name("shapedb_call_duration_seconds")
            .Help("Time from the arrival of a call to its answer, uploads and waiting included, by rpc.")
            .Register(*registry);
    prometheus::Counter& received = prometheus::BuildCounter()
                                        .Name("shapedb_received_point_bytes_total")
                                        .Help("Bytes of points received from clients.")
                                        .Register(*registry)
                                        .Add({});
    std::shared_ptr<prometheus::Collectable> state;
    std::unique_ptr<prometheus::Exposer> exposer;
};

Metrics::Metrics() : parts_(std::make_unique<Parts>()) {}

Metrics::~Metrics() { stop(); }

void Metrics::recordCall(const char* rpc, const char* code, double seconds, std::uint64_t pointBytes) {
    parts_->calls.Add({{"rpc", rpc}, {"code", code}}).Increment();
    parts_->seconds.Add({{"rpc", rpc}}, kCallSeconds).Observe(seconds);
    if (pointBytes > 0) parts_->received.Increment(static_cast<double>(pointBytes));
}

void Metrics::setSampler(Sampler sampler) {
    parts_->state = std::make_shared<SampledState>(std::move(sampler));
}

Result<int> Metrics::serve(const std::string& address) {
    try {
        parts_->exposer = std::make_unique<prometheus::Exposer>(std::vector<std::string>{
            "listening_ports", address, "num_threads", kHttpThreads, "request_timeout_ms", kHttpTimeoutMs});
        parts_->exposer->RegisterCollectable(parts_->registry);
        if (parts_->state) parts_->exposer->RegisterCollectable(parts_->state);
        const auto ports = parts_->exposer->GetListeningPorts();
        return ports.empty() ? 0 : ports.front();
    } catch (const std::exception& error) {
        return fail(ErrorCode::kUnavailable,
                    "metrics cannot be served on " + address + ": " + error.what() + "; is the port free?");
    }
}

void Metrics::stop() { parts_->exposer.reset(); }

std::string Metrics::page() const {
    auto families = parts_->registry->Collect();
    if (parts_->state) {
        for (auto& family : parts_->state->Collect()) families.push_back(std::move(family));
    }
    return prometheus::TextSerializer().Serialize(families);
}

}  // namespace shapedb::telemetry
