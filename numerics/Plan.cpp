// SPDX-License-Identifier: MIT
#include "numerics/Plan.h"
#include "numerics/PlanFamily.h"
#include "numerics/Window.h"
#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace PSE::numerics {

namespace {

/// splitting parameter times radius, what a Plan accepts
constexpr double SMALLEST_XI = 1e-6, LARGEST_XI = 4;
/// beta; exp(beta) must stay finite, and no tolerance asks for more than 28
constexpr double LARGEST_SHAPE = 60;
/// in radii: the images within reach are (2/0.1)^3 per pair, and more below
constexpr double SMALLEST_BOX = 0.1;
/// widths of the box (and at least 8 radii): like forces in all images add up to what a tail that
/// is cut off is not estimated for
constexpr double FARTHEST_IMAGES = 4;
constexpr double MOST_IMAGES = 1e6; ///< of one pair, when the range exceeds half the box
constexpr double DENSEST = 100;     ///< volume fraction; beyond, the sums cancel too much

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
                << " particles of radius " << r.radius << " nm"
                << (r.radii.empty() ? "" : " and others") << " in " << r.box.volume()
                << " nm^3), the limit is " << DENSEST << "; use a larger box or fewer particles";
    if (!message.str().empty())
        throw std::invalid_argument(message.str());
}

} // namespace

void checkPlan(const Plan& plan, const PlanRequest& request) {
    std::ostringstream message;
    if (!plan.split && !plan.mixture) {
        message << "no numerical parameters fit a radius of " << request.radius
                << " nm in this box; check the units of radius and box";
        throw std::invalid_argument(message.str());
    }
    const double farthest = std::max(FARTHEST_IMAGES * request.box.smallestWidth(), 8 * plan.a),
                 range = plan.mixture ? plan.mixture->rangeOfPoints() * plan.a : plan.realCutoff;
    if (request.overrides.xi > 0 && plan.sumImages && range > farthest) {
        message << "a splitting parameter of " << plan.xi << " /nm has a real-space range of "
                << range << " nm; sums over images farther than " << farthest
                << " nm lose accuracy in this box; choose a larger splitting parameter, or 0 for "
                   "the automatic one";
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
    if (plan.hasRealHalf() && plan.realCutoff < 2 * plan.a) {
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

double meanNeighbours(const Lattice& box, double particles, double range) {
    return particles / box.volume() * 4.0 / 3 * M_PI * range * range * range;
}

double meanNeighbours(const Plan& plan, const Lattice& box, double particles) {
    if (!plan.mixture)
        return meanNeighbours(box, particles, plan.realCutoff);
    // the mean of (R + ai + aj)^3 over all pairs, by the moments of the radii
    double m1 = 0, m2 = 0, m3 = 0;
    for (double a : plan.mixture->particleRadii()) {
        m1 += a;
        m2 += a * a;
        m3 += a * a * a;
    }
    const double n = plan.mixture->particleRadii().size(), R = plan.mixture->rangeOfPoints();
    m1 /= n;
    m2 /= n;
    m3 /= n;
    const double cubes = R * R * R + 6 * R * R * m1 + 6 * R * (m2 + m1 * m1) + 2 * m3 + 6 * m1 * m2;
    return meanNeighbours(box, particles, plan.a * std::cbrt(cubes));
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

namespace {

/**
 * What the other split must save, by the model of PlanCost.h, before it is preferred to the prolate
 * one.
 */
constexpr double WORTH_A_CHANGE = 0.05;

/// Spheres up to which all may be at one place, which may be the worst between grid points; of
/// more, as many are taken to be at each. Plans of so few cost little, whatever their grid.
constexpr int FEW = 100;

Plan hasimotoPlan(const PlanRequest& request, Places places, const std::string& reason) {
    Plan plan = HasimotoPlans(request, places).best();
    plan.splitReason = reason;
    return plan;
}

} // namespace

bool isPrescribed(const PlanOverrides& wish) {
    return wish.xi > 0 || wish.realCutoff > 0 || wish.bandwidth > 0;
}

bool isMixture(const std::vector<double>& radii) {
    return std::any_of(radii.begin(), radii.end(), [&](double a) { return a != radii[0]; });
}

namespace {

Plan planFor(const PlanRequest& request, Places places) {
    if (isMixture(request.radii)) {
        PlanRequest mixed = request;
        mixed.radius = MixturePlans::unitRadius(request.radii);
        checkRequest(mixed);
        const Plan plan = MixturePlans(mixed, places).best();
        checkPlan(plan, mixed);
        return plan;
    }
    checkRequest(request);
    if (request.model == SphereModel::ForceCoupling)
        return makeForceCouplingPlan(request, places);
    if (request.split == SplitChoice::AllWaves)
        throw std::invalid_argument(
            "the waves of the Rotne-Prager-Yamakawa mobility decay too slowly to do without a "
            "real half; use setSplit(AutomaticSplit), or setMobilityModel(ForceCoupling)");
    if (request.split == SplitChoice::Hasimoto)
        return hasimotoPlan(request, places, "as prescribed");
    const ProlatePlans family(request, places);
    std::string obstacle;
    std::optional<Plan> prolate = family.best(obstacle);
    if (prolate)
        prolate->splitReason = "default";
    if (request.split == SplitChoice::Prolate) {
        if (!prolate)
            throw std::invalid_argument(
                obstacle + ", or another split, setSplit(AutomaticSplit) or setSplit(Hasimoto)");
        prolate->splitReason = "as prescribed";
    } else if (!prolate)
        return hasimotoPlan(request, places, "because " + obstacle);
    checkPlan(*prolate, request);
    if (request.split == SplitChoice::Prolate ||
        (isPrescribed(request.overrides) && prolate->predictedError <= request.tolerance))
        return *prolate;
    const bool keeps = prolate->predictedError <= request.tolerance;
    Plan other;
    try {
        other = hasimotoPlan(request, places,
                             "because the cost model finds it cheaper here than the "
                             "prolate split, which would be valid");
    } catch (const std::invalid_argument&) {
        if (!keeps)
            throw;
        return *prolate; // there is nothing to compare with
    }
    if (!keeps && other.predictedError <= request.tolerance) {
        other.splitReason = "because the prolate split would miss the tolerance with what is "
                            "prescribed";
        return other;
    }
    // A sum over images is for few particles: a step costs next to nothing, whatever its split.
    const bool cheaper =
        !other.sumImages && family.cost(other) < (1 - WORTH_A_CHANGE) * family.cost(*prolate);
    return cheaper && (!keeps || other.predictedError <= request.tolerance) ? other : *prolate;
}

std::optional<Plan> planIfAny(const PlanRequest& request, Places places) {
    try {
        return planFor(request, places);
    } catch (const std::invalid_argument&) {
        return std::nullopt;
    }
}

} // namespace

Plan makePlan(const PlanRequest& request) {
    // a sum over modes has no grid that places could matter for
    if (request.numParticles > FEW || request.directSums)
        return planFor(request, Places::Spread);
    std::optional<Plan> precise; // keeps the tolerance in double precision, where single would do
    for (Places places : {Places::Together, Places::TogetherSteep}) {
        const std::optional<Plan> plan = planIfAny(request, places);
        if (plan && plan->predictedError <= request.tolerance) {
            if (plan->precision == Precision::Single || request.tolerance < request.singleFloor)
                return *plan;
            precise = precise ? precise : plan;
        }
        if (isMixture(request.radii) || request.overrides.windowShape > 0)
            break; // the window is the same
    }
    // Near the ends of what precision there is, and where a prescribed grid or window does not
    // serve the worst place, the mean over places has to do.
    return precise && !request.singleOnly ? *precise : planFor(request, Places::Spread);
}

} // namespace PSE::numerics
