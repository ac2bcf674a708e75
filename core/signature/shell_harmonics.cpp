// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/shell_harmonics.h"

#include <cmath>
#include <numeric>

#include "core/signature/histogram.h"

namespace shapedb {

namespace {

constexpr std::size_t kCoefficients = (kDegrees + 1) * (kDegrees + 1);

// Real spherical harmonics of a direction, at index l * l + l + m, normalised so that the squares of each
// degree sum to 1 (addition theorem).
void evaluate(const Point3& direction, std::array<double, kCoefficients>& out) {
    const double z = direction.z;
    const double s = std::hypot(direction.x, direction.y);
    // At the poles any azimuth will do: all terms that depend on it have s as a factor.
    const double cosine = s > 0.0 ? direction.x / s : 1.0;
    const double sine = s > 0.0 ? direction.y / s : 0.0;
    // p[l][m]: associated Legendre functions with the factor sqrt((l - m)! / (l + m)!).
    std::array<std::array<double, kDegrees + 1>, kDegrees + 1> p{};
    p[0][0] = 1.0;
    for (std::size_t m = 1; m <= kDegrees; ++m) {
        const double k = static_cast<double>(m);
        p[m][m] = std::sqrt((2.0 * k - 1.0) / (2.0 * k)) * s * p[m - 1][m - 1];
    }
    // The three-term recursion of Legendre functions in l, for the scaled ones.
    for (std::size_t m = 0; m < kDegrees; ++m) {
        p[m + 1][m] = std::sqrt(2.0 * static_cast<double>(m) + 1.0) * z * p[m][m];
        for (std::size_t l = m + 2; l <= kDegrees; ++l) {
            const double a = static_cast<double>(l * l - m * m);
            const double b = static_cast<double>((l - 1) * (l - 1) - m * m);
            p[l][m] = ((2.0 * static_cast<double>(l) - 1.0) * z * p[l - 1][m] - std::sqrt(b) * p[l - 2][m]) /
                      std::sqrt(a);
        }
    }
    double c = 1.0;  // cos and sin of m times the azimuth
    double d = 0.0;
    for (std::size_t m = 0; m <= kDegrees; ++m) {
        const double factor = m == 0 ? 1.0 : std::sqrt(2.0);
        for (std::size_t l = m; l <= kDegrees; ++l) {
            out[l * l + l + m] = factor * p[l][m] * c;
            if (m > 0) out[l * l + l - m] = factor * p[l][m] * d;
        }
        const double next = c * cosine - d * sine;
        d = c * sine + d * cosine;
        c = next;
    }
}

}  // namespace

ShellEnergies shellHarmonics(const PointCloud& points, const std::vector<double>& weights) {
    double total = static_cast<double>(points.size());
    if (!weights.empty()) total = std::accumulate(weights.begin(), weights.end(), 0.0);
    const auto share = [&](std::size_t i) { return (weights.empty() ? 1.0 : weights[i]) / total; };
    Point3 centre;
    for (std::size_t i = 0; i < points.size(); ++i) centre = centre + share(i) * points[i];
    double meanRadius = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) meanRadius += share(i) * distance(points[i], centre);
    ShellEnergies energies{};
    if (!(meanRadius > 0.0)) return energies;

    std::array<std::array<double, kCoefficients>, kShells> sums{};
    std::array<double, kCoefficients> values{};
    for (std::size_t n = 0; n < points.size(); ++n) {
        const Point3& p = points[n];
        const double radius = distance(p, centre);
        if (!(radius > 0.0)) continue;
        evaluate((1.0 / radius) * (p - centre), values);
        const SoftBin shell = softBin(radius, 0.0, 2.0 * meanRadius, kShells);
        for (std::size_t i = 0; i < kCoefficients; ++i) {
            sums[shell.bin][i] += share(n) * (1.0 - shell.share) * values[i];
            sums[shell.bin + 1][i] += share(n) * shell.share * values[i];
        }
    }
    for (std::size_t shell = 0; shell < kShells; ++shell) {
        for (std::size_t l = 1; l <= kDegrees; ++l) {
            double energy = 0.0;
            for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i) {
                energy += sums[shell][i] * sums[shell][i];
            }
            energies[shell * kDegrees + l - 1] = std::sqrt(energy);
        }
    }
    return energies;
}

}  // namespace shapedb
