// SPDX-License-Identifier: MIT
#include "numerics/WaveFactors.h"
#include "numerics/Window.h"
#include <algorithm>
#include <cfloat>
#include <cmath>

namespace PSE::numerics {

WaveFactors::WaveFactors(const Plan& plan, const Lattice& box)
    : split(plan.split), mixture(plan.mixture), grid(plan.grid),
      waveVectors(plan.a * box.waveVectors()),
      unit(6 * M_PI * plan.a * plan.a * plan.a / box.volume()) {
    if (mixture) {
        radial.emplace_back(plan.windowSupport, plan.windowShape, plan.windowSpacing);
        cell = box.volume() / (plan.a * plan.a * plan.a * plan.gridPoints());
        return;
    }
    const Window window(plan.windowSupport, plan.windowShape);
    for (int d = 0; d < 3; d++)
        for (int i = 0; i < grid[d]; i++)
            inverse[d].push_back(1 / window.transform(2 * M_PI * waveNumber(d, i) / grid[d]));
}

double WaveFactors::operator()(int x, int y, int z) const {
    const int nx = waveNumber(0, x), ny = waveNumber(1, y);
    if ((nx == 0 && ny == 0 && z == 0) || 2 * nx == grid[0] || 2 * ny == grid[1] ||
        2 * z >= grid[2])
        return 0;
    const double k = (waveVectors * Vec3(nx, ny, double(z))).norm();
    if (mixture)
        return ofMixture(k);
    const double deconvolution = inverse[0][x] * inverse[1][y] * inverse[2][z];
    return unit * split->waveWeight(k) / (k * k) * deconvolution * deconvolution;
}

/** Without the radii: they are in the weights of the grid points. */
double WaveFactors::ofMixture(double k) const {
    if (k > radial[0].band())
        return 0;
    const double deconvolution = cell / radial[0].transform(k);
    return unit * mixture->envelope(k) / (k * k) * deconvolution * deconvolution;
}

namespace {

/// of the tables' error: an error e of w makes one of about 2 e in M [T36]
constexpr double SHARE = 0.1;
constexpr double SMALLEST_ERROR = 1e-13;

} // namespace

MovingWaveFactors::MovingWaveFactors(const Plan& plan) : a(plan.a), perVolume(1), timesVolume(0) {
    const WeightErrors errors = {std::max(SMALLEST_ERROR, SHARE * plan.tableError),
                                 plan.precision == Precision::Single ? FLT_EPSILON : DBL_EPSILON};
    for (int d = 0; d < 3; d++)
        for (int i = 0; i < (d < 2 ? plan.grid[d] : plan.grid[d] / 2 + 1); i++)
            deconvolution[d].push_back(2 * i == plan.grid[d] ? 0 : 1);
    if (plan.mixture) {
        const RadialWindow window(plan.windowSupport, plan.windowShape, plan.windowSpacing);
        const double peak = window.transform(0), points = plan.gridPoints();
        const auto inverseSquare = [&](double k) {
            const double inverse = peak / window.transform(k);
            return inverse * inverse;
        };
        weight = fitWaveWeight([&](double k) { return plan.mixture->envelope(k); }, inverseSquare,
                               std::min(window.band(), plan.mixture->largestWaveNumber()), errors);
        timesVolume = 1 / (peak * peak * points * points);
        perVolume = 0;
        return;
    }
    weight = fitWaveWeight([&](double k) { return plan.split->waveWeight(k); },
                           [](double) { return 1.0; }, plan.split->largestWaveNumber(), errors);
    const Window window(plan.windowSupport, plan.windowShape);
    for (int d = 0; d < 3; d++)
        for (size_t i = 0; i < deconvolution[d].size(); i++) {
            const int index = static_cast<int>(i),
                      n = 2 * index <= plan.grid[d] ? index : index - plan.grid[d];
            const double transform = window.transform(2 * M_PI * n / plan.grid[d]);
            deconvolution[d][i] /= transform * transform;
        }
}

double MovingWaveFactors::scale(const Lattice& box) const {
    const double volume = box.volume() / (a * a * a);
    return 6 * M_PI * (perVolume / volume + timesVolume * volume);
}

} // namespace PSE::numerics
