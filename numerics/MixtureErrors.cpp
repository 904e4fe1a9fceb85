// SPDX-License-Identifier: MIT
#include "numerics/MixtureErrors.h"
#include "numerics/NearImages.h"
#include "numerics/PlanFamily.h"
#include "numerics/Quadrature.h"
#include "numerics/SphericalBessel.h"
#include <algorithm>
#include <cmath>
#include <map>

namespace PSE::numerics {

namespace {

/// mean of a diagonal entry of I - kk, measure of the k integral, and b = 6 pi w/k^2
constexpr double PROJECTION = (2.0 / 3) / (2 * M_PI * M_PI), FACTOR = 6 * M_PI;
constexpr double SPHERES = 4 * M_PI / 3;
/// Of the local volume fraction, for each kind of sphere alone: in a cluster of its like the
/// velocities of the others, too, are what an error is relative to.
constexpr double CLUSTER_SHARE = 1.0 / 3;
/// up to which images of one place are summed one by one; integrals serve for more
constexpr double MOST_IMAGES = 3000;

double shareOutside(const std::array<double, 3>& faces, double k) {
    double outside = 0;
    for (double face : faces)
        outside += std::max(0.0, 1 - face / k);
    return std::min(1.0, outside);
}

Eigen::ArrayXd sincs(double k, const Eigen::ArrayXd& radii) {
    return radii.unaryExpr([k](double a) { return sinc(k * a); });
}

} // namespace

Composition::Composition(const std::vector<double>& particleRadii) {
    std::map<double, double> distinct;
    for (double a : particleRadii)
        distinct[a]++;
    const double smallest = distinct.begin()->first, largest = distinct.rbegin()->first;
    if (distinct.size() <= MOST) {
        for (const auto& [a, count] : distinct) {
            radii.push_back(a);
            counts.push_back(count);
        }
        return;
    }
    // Each goes to the nearest of a geometric series.
    const double ratio = std::log(largest / smallest) / (MOST - 1);
    std::vector<double> bins(MOST, 0.0);
    for (const auto& [a, count] : distinct)
        bins[std::lround(std::log(a / smallest) / ratio)] += count;
    for (int i = 0; i < MOST; i++)
        if (bins[i] > 0) {
            radii.push_back(i == MOST - 1 ? largest : smallest * std::exp(ratio * i));
            counts.push_back(bins[i]);
        }
}

double Composition::particles() const {
    double sum = 0;
    for (double count : counts)
        sum += count;
    return sum;
}

double Composition::volume() const {
    double sum = 0;
    for (int i = 0; i < size(); i++)
        sum += counts[i] * SPHERES * radii[i] * radii[i] * radii[i];
    return sum;
}

/** The modes of a grid: quadrature over half of its Nyquist cell, the other half being the same. */
class MixtureErrors::Cell {
public:
    std::vector<Vec3> k;
    std::vector<double> weight; ///< sums to the density of the whole cell, over (2 pi)^3
    std::vector<Vec3> aliases;  ///< one of each pair G, -G
    std::array<double, 3> faces;

    Cell(const Lattice& box, const std::array<int, 3>& grid) {
        constexpr int NODES = 16;
        const Quadrature rule = gradedBand(NODES);
        Matrix3 waves = box.waveVectors() / (2 * M_PI);
        for (int d = 0; d < 3; d++) {
            waves.col(d) *= grid[d];
            faces[d] = M_PI * effectivePoints(grid[d]) / box.length(d);
        }
        const double measure = std::fabs(waves.determinant()) / (8 * M_PI * M_PI * M_PI);
        for (int i = 0; i < NODES / 2; i++)
            for (int j = 0; j < NODES; j++)
                for (int l = 0; l < NODES; l++) {
                    k.push_back(waves * Vec3(rule.nodes[i], rule.nodes[j], rule.nodes[l]));
                    weight.push_back(2 * measure * rule.weights[i] * rule.weights[j] *
                                     rule.weights[l]);
                }
        for (int i = -1; i <= 1; i++)
            for (int j = -1; j <= 1; j++)
                for (int l = -1; l <= 1; l++)
                    if (i > 0 || (i == 0 && (j > 0 || (j == 0 && l > 0))))
                        aliases.push_back(2 * M_PI * waves * Vec3(i, j, l));
    }
};

MixtureErrors::MixtureErrors(const Composition& composition, const Lattice& box, double phi,
                             double extent, double spacing)
    : composition(composition), box(box), damping(missingModes(box, extent)), spacing(spacing) {
    const int n = composition.size();
    radii = Eigen::Map<const Eigen::ArrayXd>(composition.radii.data(), n);
    mean = Eigen::Map<const Eigen::ArrayXd>(composition.counts.data(), n) / box.volume();
    const double meanPhi = composition.volume() / box.volume(), local = std::max(phi, meanPhi);
    dense = mean * local / meanPhi;
    alone = CLUSTER_SHARE * local / (SPHERES * radii.cube());
    for (int i = 0; i < n; i++)
        if (composition.counts[i] < 2)
            alone[i] = 0;
}

MixtureErrors::Parts MixtureErrors::none() const {
    const int n = composition.size();
    const int m = (together() ? n : 0);
    return {Eigen::MatrixXd::Zero(n, n), Eigen::ArrayXd::Zero(n), Eigen::MatrixXd::Zero(m, m)};
}

double MixtureErrors::atOnePlace(const Eigen::MatrixXd& errors, int j) const {
    // like forces on all n of the kind move everything there, or each what it would move alone
    const double n = composition.counts[j];
    double velocities = 0, wrong = 0;
    for (int i = 0; i < composition.size(); i++) {
        const double mobility = mobilityAmongImages(spacing, radii[i], radii[j]);
        velocities += composition.counts[i] * mobility * mobility;
        wrong += composition.counts[i] * errors(i, j) * errors(i, j);
    }
    const double all = wrong / std::max(radii[j] * radii[j] * velocities, 1 / n);
    // The other kinds may be elsewhere, and with them much motion that has little error.
    const double mobility = mobilityAmongImages(spacing, radii[j], radii[j]),
                 own = errors(j, j) / std::max(radii[j] * mobility, 1 / n);
    return std::max(all, own * own);
}

double MixtureErrors::worst(const Parts& parts) const {
    double largest = 0;
    for (int j = 0; j < composition.size(); j++) {
        const Eigen::ArrayXd pairs = parts.pairs.col(j).array();
        const double around = std::max((dense * pairs).sum(), (alone * pairs).maxCoeff());
        const double there = (together() ? atOnePlace(parts.together, j) : 0);
        largest = std::max(largest, radii[j] * std::sqrt(around + parts.self[j] + there));
    }
    return largest;
}

double MixtureErrors::dropped(const ProlateEnvelope& envelope) const {
    // The squares of sinc fall as k^-4: ten times the end is far enough.
    constexpr double FARTHEST = 10;
    const double end = envelope.largestWaveNumber();
    static const Quadrature rule = gaussLegendre(64, 0, 1);
    Parts parts = none();
    for (size_t q = 0; q < rule.nodes.size(); q++) {
        const double growth = std::pow(FARTHEST, rule.nodes[q]), k = end * growth;
        const double dk = rule.weights[q] * std::log(FARTHEST) * k;
        const Eigen::VectorXd squares = sincs(k, radii).square();
        parts.pairs += PROJECTION * FACTOR * FACTOR * envelope.squareBeyond(k) / (k * k) * dk *
                       squares * squares.transpose();
    }
    return worst(parts);
}

double MixtureErrors::realTruncation(const Mixture& mixture) const {
    constexpr int NODES = 24;
    constexpr double PERIODS = 4; // of the shortest waves: what is left beyond falls fast
    const double end = mixture.largestWaveNumber(), further = PERIODS * 2 * M_PI / end,
                 farthest = mixture.largestRange() + further;
    const MixtureQuadrature waves(mixture, farthest);
    Parts parts = none();
    Eigen::MatrixXd alike = parts.pairs;
    std::vector<Vec3> images;
    if (together() && box.imageCandidates(farthest) <= MOST_IMAGES)
        images = box.imagesWithin(farthest);
    for (int i = 0; i < composition.size(); i++)
        for (int j = 0; j <= i; j++) {
            const double ai = radii[i], aj = radii[j], from = mixture.range(ai, aj);
            const Quadrature rule = gaussLegendre(NODES, from, from + further);
            const std::vector<double> pair = waves.of(ai, aj);
            const auto left = [&](double r) {
                const PairScalars rpy = rpyScalars(r, ai, aj);
                const SmoothScalars wave = waves.at(r, pair);
                return PairScalars{rpy.F - wave.F, rpy.G - wave.F - wave.C * r * r};
            };
            double random = 0, coherent = 0;
            for (int q = 0; q < NODES; q++) {
                const double r = rule.nodes[q], shell = 4 * M_PI * r * r * rule.weights[q];
                const PairScalars rest = left(r);
                random += shell * (2 * rest.F * rest.F + rest.G * rest.G) / 3;
                coherent += shell * (2 * rest.F + rest.G) / 3;
            }
            parts.pairs(i, j) = parts.pairs(j, i) = random;
            alike(i, j) = alike(j, i) = std::fabs(coherent);
            if (images.empty())
                continue;
            Matrix3 sum = Matrix3::Zero(); // over the images of one place
            for (const Vec3& image : images) {
                const double r = image.norm();
                if (r <= from || r > from + further)
                    continue;
                const PairScalars rest = left(r);
                sum += rest.F * Matrix3::Identity() +
                       (rest.G - rest.F) / (r * r) * image * image.transpose();
            }
            parts.together(i, j) = parts.together(j, i) = sum.colwise().norm().maxCoeff();
        }
    parts.self = (alike.transpose() * mean.matrix()).array().square();
    return worst(parts);
}

void MixtureErrors::addOutside(const Mixture& mixture, const Cell& cell, const RadialWindow* window,
                               Parts& parts) const {
    const double nearest = *std::min_element(cell.faces.begin(), cell.faces.end()),
                 end = mixture.largestWaveNumber(), band = window ? window->band() : end;
    if (std::min(nearest, band) >= end)
        return;
    const Quadrature rule = gaussLegendre(64, std::min(nearest, band), end);
    Eigen::ArrayXd lost = Eigen::ArrayXd::Zero(radii.size());
    for (size_t q = 0; q < rule.nodes.size(); q++) {
        const double k = rule.nodes[q], H = mixture.envelope(k);
        const double share = (k > band ? 1 : shareOutside(cell.faces, k)) * rule.weights[q];
        const Eigen::VectorXd squares = sincs(k, radii).square();
        parts.pairs +=
            PROJECTION * FACTOR * FACTOR * share * H * H / (k * k) * squares * squares.transpose();
        lost += PROJECTION * FACTOR * share * H * squares.array();
    }
    if (together())
        parts.together += (lost.sqrt().matrix() * lost.sqrt().matrix().transpose());
    else
        parts.self += lost.square();
}

void MixtureErrors::addAliases(const Mixture& mixture, const Cell& cell, const RadialWindow& window,
                               Parts& parts) const {
    const int n = composition.size();
    const size_t numAliases = cell.aliases.size();
    const double end = std::min(mixture.largestWaveNumber(), window.band());
    Eigen::ArrayXd bias = Eigen::ArrayXd::Zero(n);
    // what the self mobility ripples with along each reciprocal vector of the grid: 4 R cos(G.x)
    std::vector<Matrix3> ripple(numAliases * n, Matrix3::Zero());
    // and the mobility of two at one place, a third of the trace
    std::vector<Eigen::MatrixXd> mutual(together() ? numAliases : 0, Eigen::MatrixXd::Zero(n, n));
    for (size_t q = 0; q < cell.k.size(); q++) {
        const Vec3& k = cell.k[q];
        const double k2 = k.squaredNorm(), norm = std::sqrt(k2);
        if (norm >= end)
            continue;
        const double full = FACTOR * mixture.envelope(norm) / k2, b = full * k2 / (k2 + damping),
                     own = 1 / window.transform(norm);
        const Eigen::ArrayXd s = sincs(norm, radii);
        const Matrix3 transverse = Matrix3::Identity() - k * k.transpose() / k2;
        Eigen::ArrayXd aliases = Eigen::ArrayXd::Zero(n);
        for (size_t g = 0; g < numAliases; g++) {
            const double up = (k + cell.aliases[g]).norm(), down = (k - cell.aliases[g]).norm();
            const Eigen::ArrayXd first = own * window.transform(up) * sincs(up, radii),
                                 second = own * window.transform(down) * sincs(down, radii);
            aliases += first.square() + second.square();
            if (together())
                mutual[g] += 2.0 / 3 * 0.5 * cell.weight[q] * full * s.matrix() *
                             (first + second).matrix().transpose();
            else
                for (int i = 0; i < n; i++)
                    ripple[g * n + i] +=
                        0.5 * cell.weight[q] * full * s[i] * (first[i] + second[i]) * transverse;
        }
        const Eigen::VectorXd one = s.square(), more = aliases;
        parts.pairs += 2.0 / 3 * cell.weight[q] * b * b *
                       (one * more.transpose() + more * one.transpose() + more * more.transpose());
        bias += 2.0 / 3 * cell.weight[q] * full * aliases;
    }
    if (together()) {
        // Of different radii the mean of the one spread and the other gathered, and the reverse;
        // their bias is at most the geometric mean.
        for (const Eigen::MatrixXd& R : mutual)
            parts.together += 2 * (R + R.transpose()).cwiseAbs();
        parts.together += bias.sqrt().matrix() * bias.sqrt().matrix().transpose();
        return;
    }
    parts.self += bias.square();
    for (size_t g = 0; g < numAliases; g++)
        for (int i = 0; i < n; i++)
            parts.self[i] += 8 * ripple[g * n + i].squaredNorm() / 3;
}

double MixtureErrors::wave(const Mixture& mixture, const std::array<int, 3>& grid,
                           const RadialWindow* window) const {
    const Cell cell(box, grid);
    Parts parts = none();
    addOutside(mixture, cell, window, parts);
    if (window != NULL)
        addAliases(mixture, cell, *window, parts);
    return worst(parts);
}

Magnification MixtureErrors::magnification(const Mixture& mixture, const std::array<int, 3>& grid,
                                           const RadialWindow& window) const {
    const Cell cell(box, grid);
    const double end = std::min(mixture.largestWaveNumber(), window.band());
    // Errors of many weights are not alike: the shell of a large sphere has more of them.
    const Eigen::ArrayXd noise = (1 + radii / window.radius()).square().inverse();
    Parts pairs = none(), both = none();
    for (size_t q = 0; q < cell.k.size(); q++) {
        const double k = cell.k[q].norm();
        if (k >= end)
            continue;
        const double full = FACTOR * mixture.envelope(k) / (k * k),
                     b = full * k * k / (k * k + damping),
                     inverse = window.transform(0) / window.transform(k);
        const double square = inverse * inverse * cell.weight[q] * 2 / 3;
        const Eigen::VectorXd one = sincs(k, radii).square();
        pairs.pairs += square * b * b * one * noise.matrix().transpose();
        both.self += square * full * noise;
    }
    both.self = both.self.square();
    return {worst(pairs), worst(both)};
}

} // namespace PSE::numerics
