// SPDX-License-Identifier: MIT
#include "numerics/HasimotoSplit.h"
#include "numerics/Plan.h"
#include "numerics/PlanCost.h"
#include "numerics/Quadrature.h"
#include "numerics/Window.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace PSE::numerics {

namespace {

constexpr double BUDGET_PER_HALF = 0.5; ///< share of the tolerance that each half may use
/// clusters and chains are denser than the box mean
constexpr double LOCAL_VOLUME_FRACTION = 0.3;
/// splitting parameter times radius, what a Plan accepts
constexpr double SMALLEST_XI = 1e-6, LARGEST_XI = 4;
/// xi rc: what the polynomials of RealTable resolve
constexpr double LARGEST_RANGE = 8.2;
/// xi rc up to which those polynomials keep 5e-7 in single precision
constexpr double SINGLE_RANGE = 6;
/// beta; exp(beta) must stay finite, and no tolerance asks for more than 28
constexpr double LARGEST_SHAPE = 60;
/// grid points along one axis; beyond, nothing can be allocated
constexpr double WIDEST_GRID = 32768;
/// in radii: here sums have few terms, which integrals estimate only roughly
constexpr double SMALL_BOX = 12;
constexpr double SMALL_BOX_SHARE = 0.5; ///< of the budget, therefore
/// of the box: a neighbour list in single precision needs a margin below 1/2
constexpr double LARGEST_LIST_RANGE = 0.499;
/// Radii. What the window does to waves longer than this is a fixed small share of the velocity
/// that they carry, which the tolerance is relative to: farther pairs do not count. Not so in long
/// boxes, where few waves carry most of it.
constexpr double LARGEST_EXTENT = 12;
constexpr double LONG_BOX = 2; ///< longest over shortest box vector
/// in radii: the images within reach are (2/0.1)^3 per pair, and more below
constexpr double SMALLEST_BOX = 0.1;
/// refinements of grid and window beyond the rules [T15]
constexpr int LAST_ATTEMPT = 12;
constexpr int LARGEST_SUPPORT = 16;   ///< what platforms have room for
constexpr double MOST_IMAGES = 1e6;   ///< of one pair, when the range exceeds half the box
constexpr double DENSEST = 100;       ///< volume fraction; beyond, the sums cancel too much
constexpr double UNAFFORDABLE = 1e50; ///< factor on the cost of a Plan that misses the tolerance
/// predicted error below which single precision would be the larger error, as a share of its floor
constexpr double SINGLE_SHARE = 0.1;
constexpr double TABLE_SHARE = 0.05; ///< share of a half's budget for tables

double volumeFraction(const PlanRequest& r) {
    return r.numParticles * 4.0 / 3 * M_PI * r.radius * r.radius * r.radius / r.box.volume();
}

/**
 * Support and grid spacing that keep the error of the wave half, [T15]: digits + 2 points, or one
 * less on a finer grid.
 */
struct WindowChoice {
    int support;
    double finer; ///< factor on the Nyquist wave number
};

int supportFor(double error) {
    return std::clamp(static_cast<int>(std::lround(2 - std::log10(error))), 4, 14);
}

double shapeFor(double error, int support) {
    return std::max(std::log(10 / error), Window::minShape(support));
}

/**
 * Points whose modes reach the same Nyquist wave number as n points do in the limit of a large box:
 * an even grid has lost its Nyquist plane, which stands for half a mode spacing.
 */
int effectivePoints(int n) {
    return n % 2 == 0 ? n - 1 : n;
}

std::array<int, 3> gridFor(const Lattice& box, double nyquist, int support) {
    std::array<int, 3> grid;
    for (int d = 0; d < 3; d++) {
        // The length of the box vector, not the width of the box, keeps every face of the Nyquist
        // cell beyond `nyquist`.
        const double points = std::max(box.length(d) * nyquist / M_PI, double(support));
        grid[d] = static_cast<int>(std::min(std::ceil(points), 2e9));
        while (grid[d] <= WIDEST_GRID &&
               (nextFftSize(grid[d]) != grid[d] || effectivePoints(grid[d]) < points))
            grid[d]++;
    }
    return grid;
}

double orderedPairs(const PlanRequest& r, double rc, bool sumImages) {
    const double inRange = meanNeighbours(r.box, r.numParticles, rc);
    // An explicit sum looks at every pair in every image cell that the range touches.
    const double touched = r.numParticles * std::pow(1 + 2 * rc / std::cbrt(r.box.volume()), 3);
    return r.numParticles * (inRange + (sumImages ? 0.5 * touched : 0));
}

/** The one-parameter family of Plans, by xi; reduced length units inside. */
class Planner {
public:
    explicit Planner(const PlanRequest& request)
        : request(request), box(scaledBox(request)),
          error(BUDGET_PER_HALF * request.tolerance *
                (box.smallestWidth() < SMALL_BOX ? SMALL_BOX_SHARE : 1)),
          meanPhi(volumeFraction(request)), phi(std::max(meanPhi, LOCAL_VOLUME_FRACTION)),
          extent(extentOf(request, phi)) {}

    /** @param xi  in 1/a */
    Plan at(double xi, double& cost) const {
        const PlanOverrides& wish = request.overrides;
        Plan plan;
        plan.split = std::make_shared<HasimotoSplit>(xi);
        plan.a = request.radius;
        plan.xi = (wish.xi > 0 ? wish.xi : xi / plan.a);
        plan.realCutoff =
            (wish.realCutoff > 0 ? wish.realCutoff
                                 : plan.a * plan.split->realCutoff(error, phi, meanPhi));
        // little is left beyond, and counted
        plan.realCutoff = std::min(plan.realCutoff, plan.a * LARGEST_RANGE / xi);
        plan.sumImages = plan.realCutoff > LARGEST_LIST_RANGE * request.box.smallestWidth();
        plan.lanczosTolerance =
            (wish.lanczosTolerance > 0 ? wish.lanczosTolerance : 0.5 * request.tolerance);
        plan.tableError = TABLE_SHARE * error;
        const bool single =
            (request.tolerance >= request.singleFloor && plan.xi * plan.realCutoff <= SINGLE_RANGE);
        plan.precision = (single ? Precision::Single : Precision::Double);
        chooseWindow(plan, cost);
        const double real = plan.split->realTruncation(plan.realCutoff / plan.a, phi, meanPhi);
        if (real > 1.01 * error) // its range was cut
            cost *= UNAFFORDABLE;
        return plan;
    }

    /**
     * Refine an automatic grid, and widen an automatic window where that does not help, until the
     * full estimate of the wave error keeps the budget; set the predicted error.
     */
    void finish(Plan& plan) const {
        const PlanOverrides& wish = request.overrides;
        const bool freeGrid = (wish.grid[0] == 0),
                   freeWindow = (wish.windowSupport == 0 && wish.windowShape == 0);
        double wave = waveErrorOf(plan);
        for (int attempt = 1; freeGrid && wave > error && attempt <= LAST_ATTEMPT; attempt++) {
            if (freeWindow && attempt % 3 == 0 && plan.windowSupport < LARGEST_SUPPORT) {
                plan.windowSupport++;
                plan.windowShape = shapeFor(error, plan.windowSupport);
            }
            for (int d = 0; d < 3; d++)
                plan.grid[d] = nextFftSize(std::max(plan.grid[d] + 1, plan.windowSupport));
            wave = waveErrorOf(plan);
        }
        const double real = plan.split->realTruncation(plan.realCutoff / plan.a, phi, meanPhi);
        plan.predictedError = std::hypot(wave, real);
        if (plan.predictedError < SINGLE_SHARE * request.singleFloor)
            plan.precision = Precision::Double;
        if (wish.realCutoff == 0 && wish.xi == 0 && !(real <= request.tolerance)) {
            std::ostringstream message;
            message << "the smallest error that the real half reaches here is " << real
                    << ", the tolerance is " << request.tolerance
                    << "; loosen the tolerance or use a larger box";
            throw std::invalid_argument(message.str());
        }
        if (wish.realCutoff == 0 && !(real <= request.tolerance)) {
            std::ostringstream message;
            message << "splitting parameter " << plan.xi << " /nm leaves an error of " << real
                    << " in the real half, the "
                    << "tolerance is " << request.tolerance
                    << "; choose a smaller splitting parameter, or 0 for the automatic one";
            throw std::invalid_argument(message.str());
        }
        if (freeGrid && !(wave <= request.tolerance)) {
            std::ostringstream message;
            message << "a window of support " << plan.windowSupport << " and shape "
                    << plan.windowShape << " leaves an error of " << wave
                    << " on any grid, the tolerance is " << request.tolerance
                    << "; prescribe a larger support, or neither support nor shape";
            throw std::invalid_argument(message.str());
        }
    }

private:
    static Lattice scaledBox(const PlanRequest& r) {
        const Matrix3 v = r.box.vectors() / r.radius;
        return Lattice(v.col(0), v.col(1), v.col(2));
    }

    /** Edge of the cube that the particles fill at volume fraction phi, in radii. */
    static double extentOf(const PlanRequest& r, double phi) {
        const double lengths[3] = {r.box.length(0), r.box.length(1), r.box.length(2)};
        const double shortest = *std::min_element(lengths, lengths + 3),
                     longest = *std::max_element(lengths, lengths + 3);
        if (longest > LONG_BOX * shortest)
            return std::numeric_limits<double>::infinity();
        return std::min(LARGEST_EXTENT, std::cbrt(4.0 / 3 * M_PI * r.numParticles / phi));
    }

    double waveErrorOf(const Plan& plan) const {
        return waveError(*plan.split, box, plan.grid, plan.windowSupport, plan.windowShape, phi,
                         extent);
    }

    void chooseWindow(Plan& plan, double& cost) const {
        const PlanOverrides& wish = request.overrides;
        const double pairs = orderedPairs(request, plan.realCutoff, plan.sumImages);
        const double products = 1 + (request.thermal ? 1 - std::log10(request.tolerance) : 0);
        const double nyquist = plan.split->waveCutoff(error, phi);
        const int digits = supportFor(error);
        cost = std::numeric_limits<double>::infinity();
        for (const WindowChoice& choice :
             {WindowChoice{digits, 1.0}, WindowChoice{digits - 1, digits <= 6 ? 1.24 : 1.14}}) {
            const int support = (wish.windowSupport > 0 ? wish.windowSupport : choice.support);
            std::array<int, 3> grid = gridFor(box, nyquist * choice.finer, support);
            if (wish.grid[0] > 0) {
                const bool fineEnough =
                    wish.grid[0] >= grid[0] && wish.grid[1] >= grid[1] && wish.grid[2] >= grid[2];
                if (choice.finer > 1 && !fineEnough)
                    continue; // the smaller support needs its finer grid
                grid = wish.grid;
            }
            const double points = double(grid[0]) * grid[1] * grid[2];
            const double estimate =
                request.directSums
                    ? CostModel::directStep(request.numParticles, points, pairs, products)
                    : CostModel::step(request.numParticles, points, support, pairs, products);
            if (estimate < cost) {
                cost = estimate;
                plan.grid = grid;
                plan.windowSupport = support;
            }
        }
        plan.windowShape =
            (wish.windowShape > 0 ? wish.windowShape : shapeFor(error, plan.windowSupport));
    }

    const PlanRequest& request;
    Lattice box;
    double error, meanPhi, phi, extent;
};

void checkRequest(const PlanRequest& r) {
    std::ostringstream message;
    const double xi = r.overrides.xi * r.radius;
    if (r.overrides.xi > 0 && (xi < SMALLEST_XI || xi > LARGEST_XI))
        message << "splitting parameter " << r.overrides.xi << " /nm is " << xi
                << " in units of 1/radius, outside [" << SMALLEST_XI << ", " << LARGEST_XI
                << "]; call setSplittingParameter(0) for the automatic one";
    for (int d = 2; d >= 0 && message.str().empty(); d--)
        if (r.box.length(d) < SMALLEST_BOX * r.radius)
            message << "box vector " << d << " has length " << r.box.length(d) << " nm, less than "
                    << SMALLEST_BOX << " of the radius " << r.radius << " nm; use a larger box";
    const double phi = volumeFraction(r);
    if (message.str().empty() && !(phi <= DENSEST))
        message << "the volume fraction is " << phi << " (" << r.numParticles
                << " particles of radius " << r.radius << " nm in " << r.box.volume()
                << " nm^3), the limit is " << DENSEST << "; use a larger box or fewer particles";
    if (!message.str().empty())
        throw std::invalid_argument(message.str());
}

void checkPlan(const Plan& plan, const PlanRequest& request) {
    std::ostringstream message;
    if (!plan.split) {
        message << "no numerical parameters fit a radius of " << request.radius
                << " nm in this box; check the units of radius and box";
        throw std::invalid_argument(message.str());
    }
    if (plan.sumImages && request.box.imageCandidates(plan.realCutoff) > MOST_IMAGES) {
        message << "a splitting parameter of " << plan.xi << " /nm has a real-space range of "
                << plan.realCutoff << " nm, over " << MOST_IMAGES
                << " images of this box; choose a larger splitting parameter, or 0 for the "
                   "automatic one";
        throw std::invalid_argument(message.str());
    }
    for (int d = 0; d < 3; d++) {
        if (plan.grid[d] > WIDEST_GRID)
            message
                << "the grid needs " << plan.grid[d] << " points along box vector " << d
                << ", the limit is " << WIDEST_GRID
                << "; loosen the tolerance, choose a smaller splitting parameter or a smaller box";
        else if (plan.grid[d] < plan.windowSupport)
            message << "grid dimension " << plan.grid[d] << " along box vector " << d
                    << " is smaller than the window support " << plan.windowSupport
                    << "; use more grid points (setGridDimensions) or a smaller support "
                       "(setWindowSupport)";
        if (!message.str().empty())
            throw std::invalid_argument(message.str());
    }
    if (plan.realCutoff < 2 * plan.a) {
        message << "real-space cutoff " << plan.realCutoff
                << " nm is below the distance of two touching particles, " << 2 * plan.a
                << " nm; leave the cutoff 0 for the automatic one";
        throw std::invalid_argument(message.str());
    }
    if (!(plan.windowShape <= LARGEST_SHAPE)) {
        message << "window shape " << plan.windowShape << " is above " << LARGEST_SHAPE
                << "; leave windowShape 0 for the automatic one";
        throw std::invalid_argument(message.str());
    }
    if (plan.windowShape < Window::minShape(plan.windowSupport)) {
        message << "window shape " << plan.windowShape << " is below "
                << Window::minShape(plan.windowSupport)
                << " (1.57 support), where the window's transform may have zeros; leave "
                   "windowShape 0 for the automatic one";
        throw std::invalid_argument(message.str());
    }
}

/**
 * Sum over the modes k != 0 of k^-4. The integral V/(2 pi)^3 Int (k^2 + c^2)^-2 d^3k = V/(8 pi c)
 * equals it for the c that waveError() puts in place of the missing mode k = 0; c = 3.751/L in a
 * cube.
 */
double inverseFourthPowers(const Lattice& box) {
    // in units of the shortest mode of the shortest box vector
    constexpr double REACH = 4;
    constexpr int MOST_MODES = 64; // per axis: enough for an aspect ratio of 16
    const Matrix3 waves = box.waveVectors();
    const double shortest = std::min({box.length(0), box.length(1), box.length(2)}),
                 reach = REACH * 2 * M_PI / shortest;
    int limit[3];
    for (int d = 0; d < 3; d++)
        limit[d] =
            std::min(MOST_MODES, static_cast<int>(std::ceil(REACH * box.length(d) / shortest)));
    double sum = box.volume() / (2 * M_PI * M_PI * reach); // all modes beyond the reach
    for (int i = -limit[0]; i <= limit[0]; i++)
        for (int j = -limit[1]; j <= limit[1]; j++)
            for (int l = -limit[2]; l <= limit[2]; l++) {
                const double k2 = (waves * Vec3(i, j, l)).squaredNorm();
                if (k2 > 0 && k2 < reach * reach)
                    sum += 1 / (k2 * k2);
            }
    return sum;
}

} // namespace

double meanNeighbours(const Lattice& box, double particles, double range) {
    return particles / box.volume() * 4.0 / 3 * M_PI * range * range * range;
}

int nextFftSize(int n) {
    for (;; n++) {
        int rest = n;
        for (int prime : {2, 3, 5, 7})
            while (rest % prime == 0)
                rest /= prime;
        if (rest == 1)
            return n;
    }
}

Plan makePlan(const PlanRequest& request) {
    checkRequest(request);
    const Planner planner(request);
    double cost = 0;
    Plan best = {};
    if (request.overrides.xi > 0)
        best = planner.at(request.overrides.xi * request.radius, cost);
    else {
        const double longest =
            std::max({request.box.length(0), request.box.length(1), request.box.length(2)});
        // From a range of about the whole box (few particles in a large box) to one below contact.
        const double first = std::min(0.03, 6 * request.radius / longest), last = 2.0,
                     factor = 1.12;
        // A prescribed grid serves only some xi: the cheapest of those, else the one with the
        // smallest error.
        const bool gridGiven = (request.overrides.grid[0] > 0);
        double lowest = std::numeric_limits<double>::infinity();
        for (double xi = first; xi < last; xi *= factor) {
            Plan plan = planner.at(xi, cost);
            if (gridGiven) {
                checkPlan(plan, request);
                planner.finish(plan);
                if (plan.predictedError > request.tolerance)
                    cost = plan.predictedError * 1e100;
            }
            if (cost < lowest) {
                lowest = cost;
                best = plan;
            }
        }
    }
    checkPlan(best, request);
    planner.finish(best);
    checkPlan(best, request);
    return best;
}

namespace {

/**
 * Quadrature over theta in [-pi, pi], symmetric, with nodes crowded at 0, where the wave factor of
 * a large box is peaked and plain Gauss-Legendre nodes are too far apart.
 */
Quadrature gradedBand(int nodes) {
    constexpr double CUBIC = 0.85;
    Quadrature rule = gaussLegendre(nodes, -1, 1);
    for (int i = 0; i < nodes; i++) {
        const double s = rule.nodes[i];
        rule.nodes[i] = M_PI * s * (1 - CUBIC + CUBIC * s * s);
        rule.weights[i] *= M_PI * (1 - CUBIC + 3 * CUBIC * s * s);
    }
    return rule;
}

} // namespace

double waveError(const Split& split, const Lattice& box, const std::array<int, 3>& grid,
                 int windowSupport, double windowShape, double phi, double extent) {
    constexpr int NODES = 24;
    const Quadrature rule = gradedBand(NODES);
    const Window window(windowSupport, windowShape);
    std::vector<double> aliasing(NODES), neighbour(NODES);
    for (int i = 0; i < NODES; i++) {
        aliasing[i] = window.aliasing(rule.nodes[i]);
        neighbour[i] = window.transform(rule.nodes[i] + 2 * M_PI) / window.transform(rule.nodes[i]);
    }
    Matrix3 waves = box.waveVectors() / (2 * M_PI);
    double nyquist = std::numeric_limits<double>::infinity();
    for (int d = 0; d < 3; d++) {
        waves.col(d) *= grid[d];
        nyquist = std::min(nyquist, M_PI * effectivePoints(grid[d]) / box.length(d));
    }
    const double measure =
        double(grid[0]) * grid[1] * grid[2] / box.volume() / (8 * M_PI * M_PI * M_PI);
    // Stands for the missing mode k = 0 and, in pairs, for those that the extent makes useless. The
    // self mobility goes without: that part is then on the safe side in small boxes.
    const double damping =
        std::pow(std::max(box.volume() / (8 * M_PI * inverseFourthPowers(box)), 3.751 / extent), 2);
    const double density = 3 * phi / (4 * M_PI);
    double pairs = 0, bias = 0;
    Matrix3 ripple = Matrix3::Zero();   // (direction of the ripple, component of the force)
    for (int i = 0; i < NODES / 2; i++) // w(-k) = w(k): one half, twice
        for (int j = 0; j < NODES; j++)
            for (int l = 0; l < NODES; l++) {
                const Vec3 k = waves * Vec3(rule.nodes[i], rule.nodes[j], rule.nodes[l]);
                const double k2 = k.squaredNorm();
                const double full = 6 * M_PI * split.waveWeight(std::sqrt(k2)) / k2,
                             b = full * k2 / (k2 + damping);
                const double weight =
                    2 * measure * rule.weights[i] * rule.weights[j] * rule.weights[l];
                const double all = (1 + aliasing[i]) * (1 + aliasing[j]) * (1 + aliasing[l]) - 1;
                pairs += weight * b * b * all * (2 + all); // (1 + all)^2 - 1 without cancellation
                bias += weight * full * all;
                const int node[3] = {i, j, l},
                          mirror[3] = {NODES - 1 - i, NODES - 1 - j, NODES - 1 - l};
                const Vec3 transverse = Vec3::Ones() - k.cwiseProduct(k) / k2;
                for (int d = 0; d < 3; d++)
                    ripple.row(d) += 0.5 * weight * full *
                                     (neighbour[node[d]] + neighbour[mirror[d]]) *
                                     transverse.transpose();
            }
    // A particle at x feels a ripple 4 R_d cos(2 pi x_d/h_d) in its self mobility: mean square 8
    // R_d^2.
    const double self = 8 * ripple.squaredNorm() / 3 + std::pow(2 * bias / 3, 2);
    const double truncation = split.waveTruncation(nyquist, phi);
    return std::sqrt(density * 2 / 3 * pairs + self + truncation * truncation);
}

} // namespace PSE::numerics
