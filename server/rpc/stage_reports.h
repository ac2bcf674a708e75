// SPDX-License-Identifier: GPL-3.0-or-later
// Which stage of its work a call is in, for clients that want to see it.
#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>

#include "core/base/run_context.h"
#include "server/rpc/call.h"

namespace shapedb::rpc {

/// Between two reports of one stage.
constexpr std::chrono::milliseconds kBetweenStageReports{100};

/// The context of `call`; if `wanted`, its progress is written as `stage` of a `Message`: at once as a stage
/// begins, from time to time inside one. That the client has gone ends the work, not the writing. `call` and
/// `writer` must outlive it.
template <typename Message, typename Writer>
RunContext tellingStages(Call& call, Writer& writer, bool wanted) {
    RunContext context = call.run();
    if (!wanted) return context;
    context.progress = [&call, &writer, last = std::string_view(), next = RunContext::Clock::time_point()](
                           const char* stage, std::uint64_t done, std::uint64_t total) mutable {
        const auto now = RunContext::Clock::now();
        if (stage == last && now < next) return;
        last = stage;
        next = now + kBetweenStageReports;
        Message message;
        message.mutable_stage()->set_stage(stage);
        message.mutable_stage()->set_done(done);
        message.mutable_stage()->set_total(total);
        static_cast<void>(call.write(writer, message));
    };
    return context;
}

}  // namespace shapedb::rpc
