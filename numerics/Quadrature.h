// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_QUADRATURE_H_
#define OPENMMPSE_NUMERICS_QUADRATURE_H_

#include <vector>

namespace PSE::numerics {

/** Nodes and weights of a quadrature rule on an interval: integral of f = sum weight*f(node). */
struct Quadrature {
    std::vector<double> nodes, weights;
};

/**
 * Gauss-Legendre rule, exact for polynomials up to degree 2n - 1; nodes by Newton iteration, error
 * about 1e-15.
 * @param n  number of nodes, >= 1
 */
Quadrature gaussLegendre(int n, double from, double to);

/**
 * The rule of PANEL_NODES nodes on each of the fewest equal panels that have n nodes together: for
 * many nodes in little time. Where a panel has 3/4 nodes for each radian of an oscillation, the
 * error is about 1e-14.
 */
Quadrature gaussPanels(int n, double from, double to);
constexpr int PANEL_NODES = 64;

} // namespace PSE::numerics

#endif
