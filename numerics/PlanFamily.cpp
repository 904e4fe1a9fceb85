// SPDX-License-Identifier: MIT
#include "numerics/PlanFamily.h"
#include "numerics/HasimotoSplit.h"
#include "numerics/NearImages.h"
#include "numerics/PlanCost.h"
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
/// in radii: here sums have few terms, which integrals estimate only roughly
constexpr double SMALL_BOX = 12;
constexpr double SMALL_BOX_SHARE = 0.5; ///< of the budget, therefore
/// and with a handful of terms, for Hasimoto's split and its sums over images
constexpr double TINY_BOX = 6, TINY_BOX_SHARE = 0.4;
/// Radii. What the window does to waves longer than this is a fixed small share of the velocity
/// that they carry, which the tolerance is relative to: farther pairs do not count. Not so in long
/// boxes, where few waves carry most of it.
constexpr double LARGEST_EXTENT = 12;
constexpr double LONG_BOX = 2;  ///< longest over shortest box vector
constexpr int MORE_SUPPORT = 4; ///< than the rule, at most
/// sqrt(6): what the self mobility errs by at the worst place between grid points, a sum of one
/// cosine along each axis, over the root of its mean square
constexpr double WORST_PLACE = 2.45;
/// Of the window's shape to its support, there. Beyond the first number aliases of the main lobe
/// limit what a window can do, which come nearer as a box tilts. Beyond the second these and the
/// ones of its edge may cancel in the estimate, and do not at every place.
constexpr double LARGEST_RATIO = 1.95, STEEPEST_RATIO = 2.35;
/// the other end of the grids that are tried, see FINEST, and how closely the best is sought
constexpr double COARSEST = 0.85, GRID_PRECISION = 0.004;
constexpr double UNAFFORDABLE = 1e50; ///< factor on the cost of a Plan that misses the tolerance
/// predicted error below which single precision would be the larger error, as a share of its floor
constexpr double SINGLE_SHARE = 0.1;
/// of the tolerance, for what the window makes of rounding in single precision
constexpr double ROUNDING_SHARE = 0.2;
/// of windows by the rules, which the table's share of the budget covers
constexpr double USUAL_MAGNIFICATION = 8;
/// Radial windows may err by this many times that share, divided by their magnification: 0.3
/// tolerances in M f where there are few neighbours; they take fewer terms then.
constexpr double COVERED_RADIAL = 12, LEAST_RADIAL_MAGNIFICATION = 1;
constexpr double SMALLEST_WINDOW_ERROR = 1e-12;
constexpr double SINGLE_ROUNDING = 3e-7, DOUBLE_ROUNDING = 1.2e-16;
constexpr double TABLE_SHARE = 0.025; ///< share of the tolerance for tables
/// up to which errors of tables add up to 0.1 tolerance at most where all forces are alike
constexpr double NEIGHBOURS_ALIKE = 400;
/// What rounding in single precision adds to that for each neighbour, relative to the mobility of a
/// sphere, and the share of the tolerance that it may become. Small splitting parameters, and tiny
/// boxes of many spheres, have thousands of neighbours, whose parts cancel.
constexpr double SINGLE_PAIR_ROUNDING = 3e-9, PAIR_ROUNDING_SHARE = 0.4;

/**
 * Two independent errors together. Not by std::hypot: that asks for glibc 2.35, newer than what
 * OpenMM's wheels need, and nothing here overflows.
 */
double rootOfSquares(double first, double second) {
    return std::sqrt(first * first + second * second);
}

/**
 * Support and grid spacing that keep the error of the wave half, [T15]: digits + 2 points, or one
 * less on a finer grid.
 */
struct WindowChoice {
    int support;
    double finer; ///< factor on the Nyquist wave number
};

double orderedPairs(const PlanRequest& r, double rc, bool sumImages) {
    const double inRange = meanNeighbours(r.box, r.numParticles, rc);
    // An explicit sum looks at every pair in every image cell that the range touches.
    const double touched = r.numParticles * std::pow(1 + 2 * rc / std::cbrt(r.box.volume()), 3);
    return r.numParticles * (inRange + (sumImages ? 0.5 * touched : 0));
}

Lattice scaledBox(const PlanRequest& r) {
    const Matrix3 v = r.box.vectors() / r.radius;
    return Lattice(v.col(0), v.col(1), v.col(2));
}

/** The share of the budget that the estimates may use up in a box. */
double boxShare(const PlanRequest& r) {
    return narrowestWidth(r) / r.radius < SMALL_BOX ? SMALL_BOX_SHARE : 1;
}

/** Edge of the cube that the particles fill at volume fraction phi, in radii. */
double extentOf(const PlanRequest& r, double phi) {
    const double lengths[3] = {r.box.length(0), r.box.length(1), r.box.length(2)};
    const double shortest = *std::min_element(lengths, lengths + 3),
                 longest = *std::max_element(lengths, lengths + 3);
    if (longest > LONG_BOX * shortest)
        return std::numeric_limits<double>::infinity();
    return std::min(LARGEST_EXTENT, std::cbrt(4.0 / 3 * M_PI * r.numParticles / phi));
}

} // namespace

int effectivePoints(int n) {
    return n % 2 == 0 ? n - 1 : n;
}

int supportFor(double error) {
    return std::clamp(static_cast<int>(std::lround(2 - std::log10(error))), 4, 14);
}

double shapeFor(double error, int support) {
    return std::max(std::log(10 / error), Window::minShape(support));
}

double volumeFraction(const PlanRequest& r) {
    const double smallest = r.box.volume() * r.shortest * r.shortest * r.shortest;
    if (!r.radii.empty()) {
        double cubes = 0;
        for (double a : r.radii)
            cubes += a * a * a;
        return 4.0 / 3 * M_PI * cubes / smallest;
    }
    return r.numParticles * 4.0 / 3 * M_PI * r.radius * r.radius * r.radius / smallest;
}

double narrowestWidth(const PlanRequest& r) {
    return r.shortest * r.box.smallestWidth();
}

PlanFamily::PlanFamily(const PlanRequest& request, double share, Places places)
    : request(request), box(scaledBox(request)),
      error(share * request.tolerance * boxShare(request)), meanPhi(volumeFraction(request)),
      phi(std::max(meanPhi, LOCAL_VOLUME_FRACTION)), extent(extentOf(request, phi)),
      places(places) {}

double PlanFamily::imageSpacing() const {
    if (!request.moving)
        return numerics::imageSpacing(box);
    return std::min(request.shortest * std::cbrt(box.volume()),
                    narrowestWidth(request) / request.radius);
}

double PlanFamily::together() const {
    if (places == Places::Spread)
        return 0;
    // N spheres at one place move N times as fast as one by its force: an error is relative to
    // that, or to what each would do alone
    return std::max(1.0 / request.numParticles,
                    mobilityAmongImages(imageSpacing(), 1, 1, request.model));
}

double PlanFamily::windowError() const {
    return places == Places::Spread ? error : error * together() / WORST_PLACE;
}

double PlanFamily::waveErrorOf(const Plan& plan) const {
    return waveError(*plan.split, box, plan.grid, plan.windowSupport, plan.windowShape, phi, extent,
                     together());
}

std::array<int, 3> PlanFamily::gridFor(double nyquist, int support) const {
    std::array<int, 3> grid;
    for (int d = 0; d < 3; d++) {
        // The length of the box vector, not the width of the box, keeps every face of the Nyquist
        // cell beyond `nyquist`.
        const double points = std::max(box.length(d) * nyquist / M_PI, double(support));
        grid[d] = static_cast<int>(std::min(std::ceil(points), 2e9));
        // Real transforms of an odd length take about 1.5 times as long per point.
        while (grid[d] <= WIDEST_GRID && (grid[d] % 2 != 0 || nextFftSize(grid[d]) != grid[d] ||
                                          effectivePoints(grid[d]) < points))
            grid[d]++;
    }
    return grid;
}

double PlanFamily::products() const {
    return 1 + (request.thermal ? 1 - std::log10(request.tolerance) : 0);
}

double PlanFamily::realCost(double range) const {
    return CostModel::step(0, 0, 0, orderedPairs(request, range, false), products());
}

double PlanFamily::cost(const Plan& plan) const {
    const double pairs = orderedPairs(request, plan.realCutoff, plan.sumImages);
    return request.directSums
               ? CostModel::directStep(request.numParticles, plan.gridPoints(), pairs, products())
               : CostModel::step(request.numParticles, plan.gridPoints(), plan.windowSupport, pairs,
                                 products());
}

void PlanFamily::completeRealHalf(Plan& plan) const {
    const PlanOverrides& wish = request.overrides;
    plan.moving = request.moving;
    plan.shortest = request.shortest;
    plan.sumImages = plan.realCutoff > LARGEST_LIST_RANGE * narrowestWidth(request);
    plan.lanczosTolerance =
        (wish.lanczosTolerance > 0 ? wish.lanczosTolerance : 0.5 * request.tolerance);
    const double neighbours = meanNeighbours(request.box, request.numParticles, plan.realCutoff);
    plan.tableError = TABLE_SHARE * request.tolerance * boxShare(request) /
                      std::max(1.0, neighbours / NEIGHBOURS_ALIKE);
    const bool single =
        request.tolerance >= request.singleFloor &&
        neighbours * SINGLE_PAIR_ROUNDING <= PAIR_ROUNDING_SHARE * request.tolerance &&
        (plan.mixture || plan.realCutoff / plan.a <= plan.split->tableRange(true));
    plan.precision = (single ? Precision::Single : Precision::Double);
}

double PlanFamily::realErrorOf(const Plan& plan) const {
    return plan.split->realTruncation(plan.realCutoff / plan.a, phi, meanPhi);
}

Magnification PlanFamily::magnificationOf(const Plan& plan) const {
    return magnification(*plan.split, box, plan.grid, plan.windowSupport, plan.windowShape, phi);
}

void PlanFamily::predict(Plan& plan, double wave) const {
    plan.predictedError = rootOfSquares(wave, realErrorOf(plan));
    const Magnification magnified = magnificationOf(plan);
    const bool finer = plan.predictedError < SINGLE_SHARE * request.singleFloor;
    if ((finer && !request.singleOnly) ||
        magnified.of(SINGLE_ROUNDING) > ROUNDING_SHARE * request.tolerance)
        plan.precision = Precision::Double;
    // Fewer terms of a radial window are worth some error.
    const double covered = (plan.mixture ? COVERED_RADIAL : USUAL_MAGNIFICATION),
                 least = (plan.mixture ? LEAST_RADIAL_MAGNIFICATION : USUAL_MAGNIFICATION),
                 usual = std::max(least, magnified.of(plan.tableError) / plan.tableError) / covered;
    plan.windowError = std::max(SMALLEST_WINDOW_ERROR, plan.tableError / usual);
    const double rounding =
        (plan.precision == Precision::Single ? SINGLE_ROUNDING : DOUBLE_ROUNDING);
    plan.predictedError = rootOfSquares(
        plan.predictedError, magnified.of(rounding + (usual != 1 ? plan.windowError : 0)));
}

double PlanFamily::shapeOf(int support) const {
    const double shape = shapeFor(windowError(), support);
    if (places == Places::Spread)
        return shape;
    return std::min(shape, support * (places == Places::Together ? LARGEST_RATIO : STEEPEST_RATIO));
}

std::vector<int> PlanFamily::supports() const {
    if (request.overrides.windowSupport > 0)
        return {request.overrides.windowSupport};
    const int usual = supportFor(windowError());
    return {usual, usual - 1};
}

bool PlanFamily::fitGrid(Plan& plan, double unit, double& wave) const {
    if (request.overrides.grid[0] > 0) {
        wave = waveErrorOf(plan);
        return wave <= error;
    }
    const auto evaluate = [&](double nyquist) {
        plan.grid = gridFor(nyquist * unit, plan.windowSupport);
        if (*std::max_element(plan.grid.begin(), plan.grid.end()) > WIDEST_GRID)
            return std::numeric_limits<double>::infinity();
        return waveErrorOf(plan);
    };
    // In small boxes, with few modes, the estimate alone is not to be trusted with coarser grids.
    double low = (narrowestWidth(request) / request.radius < SMALL_BOX ? 1 : COARSEST),
           high = FINEST;
    const auto widest = [&] {
        const std::array<int, 3> grid = gridFor(high * unit, plan.windowSupport);
        return *std::max_element(grid.begin(), grid.end());
    };
    while (high > low && widest() > WIDEST_GRID)
        high = std::max(low, 0.95 * high);
    wave = evaluate(high);
    if (!(wave <= error))
        return false;
    std::array<int, 3> fitting = plan.grid, failing = {0, 0, 0};
    while (high - low > GRID_PRECISION * high) {
        const double mid = std::sqrt(low * high);
        const std::array<int, 3> grid = gridFor(mid * unit, plan.windowSupport);
        bool fits = (grid == fitting);
        if (!fits && grid != failing) {
            const double found = evaluate(mid);
            fits = (found <= error);
            (fits ? fitting : failing) = grid;
            wave = (fits ? found : wave);
        }
        (fits ? high : low) = mid;
    }
    plan.grid = fitting;
    return true;
}

Plan PlanFamily::finished(const Plan& plan, double unit) const {
    std::vector<int> candidates = supports();
    const size_t usual = candidates.size();
    if (request.overrides.windowSupport == 0 && request.overrides.windowShape == 0)
        for (int wider = 1; wider <= MORE_SUPPORT; wider++) // for what the usual ones cannot do
            candidates.push_back(std::min(candidates[0] + wider, LARGEST_SUPPORT));
    Plan best = plan;
    double bestWave = std::numeric_limits<double>::infinity(), leastError = bestWave;
    bool fits = false;
    for (size_t i = 0; i < candidates.size() && !(fits && i >= usual); i++) {
        Plan candidate = plan;
        candidate.windowSupport = candidates[i];
        if (request.overrides.windowShape == 0)
            candidate.windowShape = shapeOf(candidates[i]);
        double wave = 0;
        // no grid mends what a window makes of rounding
        const bool fitting = fitGrid(candidate, unit, wave);
        const double magnified = magnificationOf(candidate).of(SMALLEST_WINDOW_ERROR),
                     both = rootOfSquares(wave, magnified);
        const bool fit = fitting && magnified <= ROUNDING_SHARE * request.tolerance;
        if (fit == fits ? (fit ? cost(candidate) < cost(best) : both < leastError) : fit) {
            best = candidate;
            bestWave = wave;
            leastError = both;
        }
        fits = fits || fit;
    }
    predict(best, bestWave);
    return best;
}

std::string PlanFamily::windowRefusal(const Plan& plan, double wave) const {
    std::ostringstream message;
    message << "a window of support " << plan.windowSupport << " and shape " << plan.windowShape
            << " leaves an error of " << wave << " on any grid, the tolerance is "
            << request.tolerance << "; prescribe a larger support, or neither support nor shape";
    return message.str();
}

HasimotoPlans::HasimotoPlans(const PlanRequest& request, Places places)
    : PlanFamily(request, BUDGET_PER_HALF, places) {
    if (narrowestWidth(request) / request.radius < TINY_BOX)
        error *= TINY_BOX_SHARE;
}

Plan HasimotoPlans::best() const {
    double cost = 0;
    Plan best = {};
    if (request.overrides.xi > 0)
        best = at(request.overrides.xi * request.radius, cost);
    else {
        const double longest =
            std::max({request.box.length(0), request.box.length(1), request.box.length(2)});
        // From a range below contact to one of about the whole box (few particles in a large box).
        constexpr double LARGEST = 2, FACTOR = 1.12;
        std::vector<double> parameters = {std::min(0.03, 6 * request.radius / longest)};
        while (parameters.back() * FACTOR < LARGEST)
            parameters.push_back(parameters.back() * FACTOR);
        // A prescribed grid serves only some xi: the cheapest of those, else the one with the
        // smallest error.
        const bool gridGiven = (request.overrides.grid[0] > 0);
        double lowest = std::numeric_limits<double>::infinity();
        for (auto xi = parameters.rbegin(); xi != parameters.rend(); ++xi) {
            Plan plan = at(*xi, cost);
            if (gridGiven) {
                checkPlan(plan, request);
                plan = finished(plan, nyquistOf(plan));
                if (plan.predictedError > request.tolerance)
                    cost = plan.predictedError * 1e100;
            }
            if (cost < lowest) {
                lowest = cost;
                best = plan;
            }
            // wider ranges cost more; sums over images are for few particles, whatever they cost
            if (!plan.sumImages && realCost(plan.realCutoff) > lowest)
                break;
        }
    }
    checkPlan(best, request);
    best = finishedOrRefused(best);
    checkPlan(best, request);
    return best;
}

Plan HasimotoPlans::at(double xi, double& cost) const {
    const PlanOverrides& wish = request.overrides;
    Plan plan = {};
    plan.split = std::make_shared<HasimotoSplit>(xi);
    plan.a = request.radius;
    plan.xi = (wish.xi > 0 ? wish.xi : xi / plan.a);
    plan.realCutoff = (wish.realCutoff > 0 ? wish.realCutoff
                                           : plan.a * plan.split->realCutoff(error, phi, meanPhi));
    // little is left beyond, and counted
    plan.realCutoff = std::min(plan.realCutoff, plan.a * plan.split->tableRange(false));
    completeRealHalf(plan);
    chooseWindow(plan, cost);
    if (realErrorOf(plan) > 1.01 * error) // its range was cut
        cost *= UNAFFORDABLE;
    if (request.singleOnly && plan.precision == Precision::Double) // its range is too wide
        cost *= UNAFFORDABLE;
    return plan;
}

void HasimotoPlans::chooseWindow(Plan& plan, double& lowest) const {
    const PlanOverrides& wish = request.overrides;
    const double nyquist = plan.split->waveCutoff(error, phi);
    const int digits = supportFor(error);
    lowest = std::numeric_limits<double>::infinity();
    for (const WindowChoice& choice :
         {WindowChoice{digits, 1.0}, WindowChoice{digits - 1, digits <= 6 ? 1.24 : 1.14}}) {
        Plan candidate = plan;
        candidate.windowSupport = (wish.windowSupport > 0 ? wish.windowSupport : choice.support);
        candidate.grid = gridFor(nyquist * choice.finer, candidate.windowSupport);
        if (wish.grid[0] > 0) {
            const std::array<int, 3>& needed = candidate.grid;
            const bool fineEnough =
                wish.grid[0] >= needed[0] && wish.grid[1] >= needed[1] && wish.grid[2] >= needed[2];
            if (choice.finer > 1 && !fineEnough)
                continue; // the smaller support needs its finer grid
            candidate.grid = wish.grid;
        }
        const double estimate = cost(candidate);
        if (estimate < lowest) {
            lowest = estimate;
            plan = candidate;
        }
    }
    plan.windowShape =
        (wish.windowShape > 0 ? wish.windowShape : shapeFor(error, plan.windowSupport));
}

Plan HasimotoPlans::finishedOrRefused(const Plan& candidate) const {
    const PlanOverrides& wish = request.overrides;
    const Plan plan = finished(candidate, nyquistOf(candidate));
    const double real = realErrorOf(plan);
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
    const double wave =
        std::sqrt(std::max(0.0, plan.predictedError * plan.predictedError - real * real));
    if (wish.grid[0] == 0 && !(wave <= request.tolerance))
        throw std::invalid_argument(windowRefusal(plan, wave));
    return plan;
}

} // namespace PSE::numerics
