// SPDX-License-Identifier: MIT
#include "numerics/Quadrature.h"
#include <cmath>

namespace PSE::numerics {

Quadrature gaussLegendre(int n, double from, double to) {
    Quadrature rule;
    rule.nodes.resize(n);
    rule.weights.resize(n);
    const double mid = 0.5 * (from + to), half = 0.5 * (to - from);
    for (int i = 0; i < n; i++) {
        double x = std::cos(M_PI * (i + 0.75) / (n + 0.5)), derivative = 1;
        for (int iteration = 0; iteration < 10; iteration++) {
            double p = 1, previous = 0;
            for (int l = 1; l <= n; l++) {
                const double next = ((2 * l - 1) * x * p - (l - 1) * previous) / l;
                previous = p;
                p = next;
            }
            derivative = n * (x * p - previous) / (x * x - 1);
            const double change = p / derivative;
            x -= change;
            if (std::fabs(change) < 1e-15)
                break;
        }
        rule.nodes[i] = mid - half * x;
        rule.weights[i] = half * 2 / ((1 - x * x) * derivative * derivative);
    }
    return rule;
}

Quadrature gaussPanels(int n, double from, double to) {
    static const Quadrature panel = gaussLegendre(PANEL_NODES, -1, 1);
    const int panels = (n + PANEL_NODES - 1) / PANEL_NODES;
    const double half = 0.5 * (to - from) / panels;
    Quadrature rule;
    rule.nodes.reserve(panels * PANEL_NODES);
    rule.weights.reserve(panels * PANEL_NODES);
    for (int p = 0; p < panels; p++)
        for (int i = 0; i < PANEL_NODES; i++) {
            rule.nodes.push_back(from + half * (2 * p + 1 + panel.nodes[i]));
            rule.weights.push_back(half * panel.weights[i]);
        }
    return rule;
}

} // namespace PSE::numerics
