// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/verdict.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

FitResult fitted(double misfit, FitKind kind) {
    FitResult fit;
    fit.misfit = misfit;
    fit.kind = kind;
    return fit;
}

TEST(Verdict, FollowsDistanceAndMisfit) {
    const struct {
        double distance;
        double misfit;
        FitKind kind;
        Verdict verdict;
    } cases[] = {
        {0.1, 0.1, FitKind::kWhole, Verdict::kSameObject},
        {0.7, 0.15, FitKind::kOneSided, Verdict::kSameObject},
        {0.1, 0.1, FitKind::kPiece, Verdict::kSameObject},  // hardly anything is missing
        {0.5, 0.1, FitKind::kPiece, Verdict::kPart},
        {0.1, 0.35, FitKind::kWhole, Verdict::kSameObjectBent},
        {0.1, 0.6, FitKind::kWhole, Verdict::kSameKind},
        {0.5, 0.5, FitKind::kPiece, Verdict::kSameKind},
        {0.8, 0.8, FitKind::kWhole, Verdict::kUnrelated},
    };
    for (const auto& one : cases) {
        EXPECT_EQ(verdictOf(one.distance, fitted(one.misfit, one.kind), true), one.verdict)
            << one.distance << " " << one.misfit;
    }
    EXPECT_EQ(verdictOf(0.1, fitted(0.35, FitKind::kWhole), false), Verdict::kSameKind)
        << "a bent object, or a mirrored one";
}

TEST(Verdict, EachHasItsNameAndReliability) {
    std::set<std::string> names;
    for (const Verdict verdict : {Verdict::kSameObject, Verdict::kSameObjectBent, Verdict::kPart,
                                  Verdict::kSameKind, Verdict::kUnrelated}) {
        EXPECT_GT(reliabilityOf(verdict), 0.5);
        EXPECT_LT(reliabilityOf(verdict), 1.0);
        names.insert(verdictName(verdict));
    }
    EXPECT_EQ(names.size(), 5u);
    EXPECT_EQ(reliabilityOf(Verdict::kNone), 0.0);
    EXPECT_EQ(std::string(verdictName(Verdict::kNone)), "");
}

}  // namespace
}  // namespace shapedb
