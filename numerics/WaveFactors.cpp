// SPDX-License-Identifier: MIT
#include "numerics/WaveFactors.h"
#include "numerics/Window.h"
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

} // namespace PSE::numerics
