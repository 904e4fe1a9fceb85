// SPDX-License-Identifier: MIT
#include "numerics/Split.h"
#include "numerics/Quadrature.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

PairScalars Split::realScalars(double r) const {
    const PairScalars total = totalScalars(sphereModel, r);
    const SmoothScalars wave = waveScalars(r);
    return {total.F - wave.F, total.G - wave.F - wave.C * r * r};
}

Split::DroppedWaves Split::integrateWaves(double from, double to,
                                          const std::function<double(double)>& share) const {
    const Quadrature rule = gaussPanels(PANEL_NODES, from, to);
    DroppedWaves sum = {0, 0};
    for (size_t i = 0; i < rule.nodes.size(); i++) {
        const double k = rule.nodes[i], w = waveWeight(k);
        sum.pairs += rule.weights[i] * share(k) * w * w / (k * k);
        sum.self += rule.weights[i] * share(k) * w;
    }
    return sum;
}

Split::DroppedWaves Split::integrateOutside(const std::array<double, 3>& faces, double to) const {
    // of a shell of radius k, the two caps beyond a pair of faces at f are 1 - f/k
    const auto share = [&](double k) {
        double outside = 0;
        for (double face : faces)
            outside += std::max(0.0, 1 - face / k);
        return std::min(1.0, outside);
    };
    return integrateWaves(*std::min_element(faces.begin(), faces.end()), to, share);
}

Split::DroppedWaves Split::droppedWaves(const std::array<double, 3>& faces) const {
    return droppedWaves(*std::min_element(faces.begin(), faces.end()));
}

double Split::waveTruncation(double kMax, double phi) const {
    return truncationOf(droppedWaves(kMax), phi).total();
}

Split::Truncation Split::bandTruncation(const std::array<double, 3>& faces, double phi) const {
    return truncationOf(droppedWaves(faces), phi);
}

Split::Truncation Split::truncationOf(const DroppedWaves& dropped, double phi) const {
    const double density = 3 * phi / (4 * M_PI);
    // b = 6 pi w/k^2; mean of |I - kk|, measure of the k integral
    const double factor = 6 * M_PI, projection = (2.0 / 3) / (2 * M_PI * M_PI);
    return {std::sqrt(density * projection * factor * factor * dropped.pairs),
            projection * factor * dropped.self};
}

double Split::waveCutoff(double error, double phi) const {
    double low = 0.02 * largestWaveNumber(), high = largestWaveNumber();
    while (high - low > 1e-4 * high) {
        const double mid = 0.5 * (low + high);
        (waveTruncation(mid, phi) > error ? low : high) = mid;
    }
    return high;
}

double Split::realCutoff(double error, double phi, double meanPhi) const {
    if (realTruncation(CONTACT, phi, meanPhi) <= error)
        return CONTACT;
    double low = CONTACT, high = maxDistance();
    while (high - low > 1e-5 * high) {
        const double mid = 0.5 * (low + high);
        (realTruncation(mid, phi, meanPhi) > error ? low : high) = mid;
    }
    return high;
}

} // namespace PSE::numerics
