// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reliability/support/faults.h"

#include <cerrno>

namespace shapedb::reliability {

namespace {

struct Plan {
    bool armed = false;
    FaultKind kind = FaultKind::kIo;
    std::uint64_t at = 0;
    bool lasting = false;
    std::uint64_t calls = 0;
    bool fired = false;
};
Plan plan;

bool canHappen(FaultKind kind, Call call) {
    switch (kind) {
        case FaultKind::kIo: return true;
        case FaultKind::kShortWrite: return call == Call::kWrite;
        case FaultKind::kSync: return call == Call::kSync;
        case FaultKind::kNoSpace:
            return call == Call::kOpen || call == Call::kWrite || call == Call::kTruncate ||
                   call == Call::kSync || call == Call::kShare || call == Call::kRename;
    }
    return false;
}

}  // namespace

void Faults::arm(FaultKind kind, std::uint64_t at, bool lasting) {
    plan = Plan{true, kind, at, lasting, 0, false};
}

void Faults::disarm() { plan.armed = false; }

bool Faults::fired() { return plan.fired; }

std::uint64_t Faults::calls() { return plan.calls; }

std::optional<FaultKind> Faults::next(Call call) {
    if (!plan.armed || !canHappen(plan.kind, call)) return {};
    ++plan.calls;
    if (plan.calls != plan.at && !(plan.lasting && plan.fired)) return {};
    plan.fired = true;
    return plan.kind;
}

int Faults::systemError(FaultKind kind) { return kind == FaultKind::kNoSpace ? ENOSPC : EIO; }

}  // namespace shapedb::reliability
