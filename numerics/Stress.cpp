// SPDX-License-Identifier: MIT
#include "numerics/Stress.h"
#include <cmath>

namespace PSE::numerics {

namespace {

/// Strain by which an energy changes its course: a repulsion r^-n has r/n, n about 12 to 24.
constexpr double STRAIN_SCALE = 0.05;

/** Of the energy by the strain x_row += gamma x_column; columns are not below rows. */
double derivative(const EnergyOfMap& energy, int row, int column, double step) {
    const auto slope = [&](double h) {
        Matrix3 map = Matrix3::Identity();
        map(row, column) += h;
        const double above = energy(map);
        map(row, column) -= 2 * h;
        return (above - energy(map)) / (2 * h);
    };
    return (4 * slope(0.5 * step) - slope(step)) / 3;
}

} // namespace

Matrix3 idealStress(double count, double kT, double volume) {
    return -count * kT / volume * Matrix3::Identity();
}

Matrix3 singleSphereStress(const std::vector<double>& radii, double viscosity, double rate,
                           double volume) {
    double cubes = 0;
    for (double a : radii)
        cubes += a * a * a;
    Matrix3 stress = Matrix3::Zero();
    // the rate of strain E has rate/2 in these entries
    stress(0, 1) = stress(1, 0) = 20 * M_PI / 3 * viscosity * cubes / volume * 0.5 * rate;
    return stress;
}

Matrix3 strainDerivative(const EnergyOfMap& energy, double step) {
    Matrix3 result;
    for (int row = 0; row < 3; row++)
        for (int column = row; column < 3; column++)
            result(row, column) = result(column, row) = derivative(energy, row, column, step);
    return result;
}

double strainStep(double rounding) {
    return std::pow(30 * rounding * std::pow(STRAIN_SCALE, 4), 0.2);
}

} // namespace PSE::numerics
