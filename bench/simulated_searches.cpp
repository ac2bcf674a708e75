// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/simulated_searches.h"

#include <utility>

#include "bench/models.h"
#include "client/cli/evaluation_run.h"
#include "client/cli/retrieval_task.h"
#include "client/io/scan_reader.h"
#include "core/base/random.h"
#include "core/base/return_if_error.h"
#include "core/geometry/motion.h"
#include "core/pipeline.h"
#include "core/preparation/scene.h"
#include "core/synthetic/bend.h"
#include "core/synthetic/degrade.h"
#include "core/views/views.h"

namespace shapedb::bench {

namespace {

// Half of them are the gallery's, the others the query's.
constexpr std::size_t kPointsOfMember = 32000;

// A table has this many points for each of the object, and is this many times as wide.
constexpr double kPointsOfTable = 0.5;
constexpr double kWidthOfTable = 2.5;

}  // namespace

const ChangeInfo& infoOf(Change change) noexcept { return kChanges[static_cast<std::size_t>(change)]; }

Result<std::vector<LabelledModel>> labelledModels(const std::vector<std::string>& folders,
                                                  std::size_t members, std::uint64_t seed,
                                                  const RunContext& context) {
    std::vector<LabelledModel> models;
    if (folders.empty()) {
        auto scans = scansOfFamilies(members, kPointsOfMember, seed);
        RETURN_IF_ERROR(scans);
        for (FamilyScan& one : *scans) models.push_back({one.family, std::move(one.points)});
        return models;
    }
    const auto scans = cli::listCollection(folders);
    RETURN_IF_ERROR(scans);
    for (const auto& scan : *scans) {
        auto read = readScan(scan.path, {}, context);
        RETURN_IF_ERROR(read);
        models.push_back({scan.label, std::move(read->points)});
    }
    return models;
}

Result<PointCloud> makeQuery(const PointCloud& model, Change change, std::uint64_t seed,
                             const RunContext& context) {
    Random random(seed);
    PointCloud cloud = halfOf(model, 1);
    double noise = 0.003;
    switch (change) {
        case Change::kRescan: cloud = subsample(cloud, cloud.size() * 6 / 10, seed); break;
        case Change::kNoisy: noise = 0.01; break;
        case Change::kSparse: cloud = subsample(cloud, 3000, seed); break;
        case Change::kOneSided: {
            auto scan = oneSidedScan(cloud, {}, seed, context);
            RETURN_IF_ERROR(scan);
            cloud = std::move(*scan);
            noise = 0.0;  // it has its own
            break;
        }
        case Change::kPiece65: cloud = cutBelow(cloud, randomDirection(random), 0.65); break;
        case Change::kPiece50: cloud = cutBelow(cloud, randomDirection(random), 0.5); break;
        case Change::kBent: cloud = bent(cloud, random.uniform(0.35, 1.22)); break;
        case Change::kTable: break;
    }
    if (noise > 0.0) RETURN_IF_ERROR(addGaussianNoise(cloud, noise, random.next()));
    Motion motion;
    motion.rotation = randomRotation(random);
    cloud = applyToCloud(motion, cloud);
    if (change != Change::kTable) return cloud;
    const auto count = static_cast<std::size_t>(kPointsOfTable * static_cast<double>(cloud.size()));
    addTable(cloud, count, kWidthOfTable, 0.0, random.next());
    motion.rotation = randomRotation(random);
    cloud = applyToCloud(motion, cloud);
    const auto scene = findScene(cloud, context);
    RETURN_IF_ERROR(scene);
    IsolateOptions dropped;
    dropped.dropPlane = true;
    return isolated(cloud, *scene, dropped);
}

Result<DescribedModel> describeModel(const PointCloud& points, bool withViews, const RunContext& context) {
    DescribedModel model;
    auto description = describe(points, parametersOf(Profile::kDefault), context);
    if (!description) {
        RETURN_IF_ERROR(context.checkpoint());
        return model;
    }
    auto surface = makeSurfacePoints(points, context);
    RETURN_IF_ERROR(surface);
    if (withViews) {
        const auto views = makeViews(*surface, points, context);
        RETURN_IF_ERROR(views);
        model.views = std::make_shared<const ShapeViews>(*views);
    }
    model.signature = std::move(description->signature);
    model.surface = std::make_shared<const SurfacePoints>(std::move(*surface));
    return model;
}

Result<Gallery> describeGallery(const std::vector<LabelledModel>& models, unsigned threads,
                                const RunContext& context) {
    Gallery gallery;
    gallery.shapes.resize(models.size());
    RETURN_IF_ERROR(
        cli::forEachItem(models.size(), threads, context, [&](std::size_t i) -> std::optional<Error> {
            auto shape = describeModel(halfOf(models[i].points, 0), true, context);
            if (!shape) return shape.error();
            gallery.shapes[i] = std::move(*shape);
            return std::nullopt;
        }));
    for (std::size_t i = 0; i < models.size(); ++i) {
        const DescribedModel& shape = gallery.shapes[i];
        if (!shape.signature) continue;
        gallery.entries.push_back({static_cast<std::int64_t>(i) + 1, {}, *shape.signature, shape.views});
    }
    return gallery;
}

}  // namespace shapedb::bench
