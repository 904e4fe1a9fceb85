// SPDX-License-Identifier: MIT
#include "numerics/MixtureTable.h"
#include "numerics/PlanCost.h"
#include "numerics/PlanFamily.h"
#include "numerics/ProlateSplit.h"
#include "numerics/WindowRows.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace PSE::numerics {

namespace {

/// Of the tolerance, for the grid, and for what the envelope drops or the real half leaves out:
/// they add in squares. Pairs are what a step of a mixture spends most of its time on, and an error
/// allowed to the real half shortens their range more than one allowed to the grid widens its mesh.
constexpr double BUDGET = 0.5, REAL_BUDGET = 0.74;
/// the same in the unit of PlanFamily::error
constexpr double DROPPED_SHARE = REAL_BUDGET / BUDGET;
/// In radii of the largest sphere: where all spheres may be at one place, what the few images and
/// modes of such a box leave out adds up, and its mean square, by integrals, says little. The share
/// of the tolerance that estimates may use up, therefore.
constexpr double NARROW_BOX = 12, NARROW_BOX_SHARE = 0.22;
/// of the tolerance, for the whole error: what the grid is finer than it need be, a shorter range
/// may use up
constexpr double PREDICTED_SHARE = 0.96;
/// how closely that range is sought, and how far
constexpr double RANGE_PRECISION = 0.01, MOST_TIGHTENING = 1.25;
constexpr double BANDWIDTH_STEP = 1.0 / 64; ///< as ProlatePlans
/// of R/c: pairs may end before R + ai + aj by about the inverse of the largest wave number
constexpr double CUT = 1.0;
/// how far from the rule the bandwidth is sought that pairs beyond their ranges ask for
constexpr double BANDWIDTH_BELOW = 2, BANDWIDTH_ABOVE = 4;
/// from one range to the next, and the smallest, in radii of the smallest sphere
constexpr double RANGE_FACTOR = 1.08, SMALLEST_RANGE = 1;
/// in widths of the box, where pairs are summed over images
constexpr double WIDEST_RANGE = 2;
/// Hasimoto's: from one xi to the next, the first one in 1/(smallest radius), and about which value
/// of xi times the range the one that keeps an error is sought
constexpr double XI_FACTOR = 1.25, LARGEST_XI = 2, REACH_BELOW = 1.5, REACH_ABOVE = 1.5;
/// beta per support: with the shells of spheres, narrower windows serve
constexpr double SHAPE_PER_SUPPORT = 2.05;
/// Nyquist wave number over that of the band, in the closed rule that ranks ranges
constexpr double FINER = 1.12;
/// of radial windows, in the volume-averaged radius: see PlanFamily
constexpr double LARGEST_EXTENT = 12;
constexpr double SINGLE_ROUNDING = 6e-8, DOUBLE_ROUNDING = 1.2e-16;
/// of the tolerance, for what Horner's rule makes of rounding
constexpr double ROUNDING_SHARE = 0.1;
constexpr double UNAFFORDABLE = 1e50;

std::vector<double> inUnits(const std::vector<double>& radii, double unit) {
    std::vector<double> reduced;
    for (double a : radii)
        reduced.push_back(a / unit);
    return reduced;
}

} // namespace

MixturePlans::MixturePlans(const PlanRequest& request, Places places)
    : PlanFamily(request, BUDGET, places), composition(inUnits(request.radii, request.radius)),
      radii(inUnits(request.radii, request.radius)),
      errors(composition, box, phi,
             std::min(extent,
                      LARGEST_EXTENT * std::cbrt(composition.volume() / composition.particles())),
             places == Places::Spread ? 0 : imageSpacing()) {
    if (places != Places::Spread &&
        narrowestWidth(request) < NARROW_BOX * request.radius * composition.radii.back())
        error = std::min(error, NARROW_BOX_SHARE * BUDGET * request.tolerance);
}

double MixturePlans::unitRadius(const std::vector<double>& radii) {
    double squares = 0;
    for (double a : radii)
        squares += 1 / (a * a);
    return std::sqrt(radii.size() / squares);
}

RadialWindow MixturePlans::windowOf(const Plan& plan) const {
    return RadialWindow(plan.windowSupport, plan.windowShape,
                        RadialWindow::spacing(box, plan.grid));
}

double MixturePlans::waveErrorOf(const Plan& plan) const {
    const RadialWindow window = windowOf(plan);
    return errors.wave(*plan.mixture, plan.grid, &window);
}

double MixturePlans::realErrorOf(const Plan& plan) const {
    return errors.realTruncation(*plan.mixture);
}

Magnification MixturePlans::magnificationOf(const Plan& plan) const {
    return errors.magnification(*plan.mixture, plan.grid, windowOf(plan));
}

double MixturePlans::shapeOf(int support) const {
    return SHAPE_PER_SUPPORT * support;
}

/** Ordered pairs in range, by that of point forces. */
double MixturePlans::pairsOf(double R, bool sumImages) const {
    double pairs = 0;
    for (int i = 0; i < composition.size(); i++)
        for (int j = 0; j < composition.size(); j++)
            pairs += composition.counts[i] *
                     meanNeighbours(box, composition.counts[j],
                                    R + composition.radii[i] + composition.radii[j]);
    if (sumImages) { // all pairs in every image cell that the range touches
        const double n = composition.particles(), widest = R + largestDiameter();
        pairs += 0.5 * n * n * std::pow(1 + 2 * widest / std::cbrt(box.volume()), 3);
    }
    return pairs;
}

double MixturePlans::cost(const Plan& plan) const {
    if (request.directSums)
        return CostModel::directStep(composition.particles(), plan.gridPoints(),
                                     pairsOf(plan.mixture->rangeOfPoints(), plan.sumImages),
                                     products());
    return spreadCost(plan) + CostModel::step(0, plan.gridPoints(), 0, 0, products()) +
           pairCost(plan.mixture->rangeOfPoints(), plan.sumImages);
}

double MixturePlans::pairCost(double R, bool sumImages) const {
    const double pairs = CostModel::MIXTURE_PAIR * pairsOf(R, sumImages);
    return CostModel::step(0, 0, 0, pairs, products());
}

/** Of spreading and gathering. */
double MixturePlans::spreadCost(const Plan& plan) const {
    const RadialWindow window = windowOf(plan);
    const double density = plan.gridPoints() / box.volume();
    double widest = 0; // points
    for (int d = 0; d < 3; d++)
        widest = std::max(widest, 2 * window.reach(composition.radii.back()) * plan.grid[d] /
                                      box.length(d));
    const bool byRows = plan.mixture->radii().size() <= WindowRows::MOST_SHAPES &&
                        plan.tableError >= WindowRows::SMALLEST_ERROR &&
                        widest < WindowRows::MOST_POINTS && box.vectors()(0, 2) == 0 &&
                        box.vectors()(1, 2) == 0;
    double cost = 0;
    if (byRows) {
        for (int i = 0; i < composition.size(); i++) {
            const double reach = window.reach(composition.radii[i]);
            cost += composition.counts[i] *
                    (CostModel::SPREAD_SPHERE +
                     CostModel::SPREAD_ROW * M_PI * reach * reach * std::cbrt(density * density));
        }
        return cost;
    }
    int degree = 0;
    for (double a : {composition.radii.front(), composition.radii.back()})
        degree = std::max(degree, window.kernel(a, plan.tableError).polynomial.degree());
    for (int i = 0; i < composition.size(); i++) {
        const double outer = window.reach(composition.radii[i]),
                     inner = std::max(0.0, composition.radii[i] - window.radius());
        cost += composition.counts[i] * density * 4 * M_PI / 3 *
                (outer * outer * outer - inner * inner * inner);
    }
    return cost * (CostModel::SPREAD_RADIAL + degree * CostModel::SPREAD_POWER);
}

double MixturePlans::givenRange() const {
    const PlanOverrides& wish = request.overrides;
    const double fromCutoff = wish.realCutoff / request.radius - largestDiameter();
    if (wish.realCutoff > 0 && !(fromCutoff > 0)) {
        std::ostringstream message;
        message << "real-space cutoff " << wish.realCutoff
                << " nm is not above the distance of two touching particles of the largest radius, "
                << largestDiameter() * request.radius
                << " nm; leave the cutoff 0 for the automatic one";
        throw std::invalid_argument(message.str());
    }
    if (wish.realCutoff == 0 && (!isProlate() || wish.xi == 0))
        return 0;
    if (!isProlate())
        return fromCutoff;
    if (wish.xi == 0) {
        constexpr int ITERATIONS = 8; // each adds more than a digit
        double R = fromCutoff;
        for (int i = 0; i < ITERATIONS; i++)
            R = fromCutoff + cutFor(R);
        return R;
    }
    const double R = 1 / (wish.xi * request.radius);
    if (fromCutoff > R + 1e-9 * wish.realCutoff / request.radius) {
        std::ostringstream message;
        message << "the prescribed splitting parameter " << wish.xi << " /nm and real-space cutoff "
                << wish.realCutoff
                << " nm are not those of one prolate range (the cutoff is at most 1/xi + twice the "
                   "largest radius); prescribe one of them";
        throw std::invalid_argument(message.str());
    }
    return R;
}

double MixturePlans::bandwidthFor(double R) const {
    if (request.overrides.bandwidth > 0)
        return request.overrides.bandwidth;
    const auto suffices = [&](double c) {
        return errors.dropped(ProlateEnvelope(c, R)) <= DROPPED_SHARE * error;
    };
    int low = static_cast<int>(ProlateSplit::SMALLEST_BANDWIDTH / BANDWIDTH_STEP) - 1,
        high = static_cast<int>(ProlateSplit::LARGEST_BANDWIDTH / BANDWIDTH_STEP);
    while (high - low > 1) {
        const int mid = (low + high) / 2;
        (suffices(mid * BANDWIDTH_STEP) ? high : low) = mid;
    }
    return high * BANDWIDTH_STEP;
}

double MixturePlans::cutFor(double R) const {
    return std::min(composition.radii.front(), CUT * R / bandwidthFor(R));
}

std::shared_ptr<const Mixture> MixturePlans::prolateMixture(double bandwidth, double R,
                                                            double cut) const {
    return std::make_shared<const Mixture>(std::make_shared<ProlateEnvelope>(bandwidth, R), radii,
                                           cut);
}

/** With the smallest range that keeps its share, or the one prescribed. */
std::shared_ptr<const Mixture> MixturePlans::hasimotoMixture(double xi) const {
    const auto with = [&](double R) {
        return std::make_shared<const Mixture>(std::make_shared<HasimotoEnvelope>(xi, R), radii);
    };
    const double given = givenRange();
    if (given > 0)
        return with(given);
    const double usual = std::sqrt(std::log(1 / error));
    double low = std::max(0.1, usual - REACH_BELOW) / xi, high = (usual + REACH_ABOVE) / xi;
    while (high - low > 0.02 * high) {
        const double mid = 0.5 * (low + high);
        (errors.realTruncation(*with(mid)) > DROPPED_SHARE * error ? low : high) = mid;
    }
    return with(high);
}

double MixturePlans::unitOf(const Plan& plan) const {
    return isProlate() ? plan.bandwidth / plan.mixture->shape().range()
                       : 2 * plan.xi * plan.a * std::sqrt(std::log(1 / error));
}

Plan MixturePlans::at(double parameter) const {
    const PlanOverrides& wish = request.overrides;
    Plan plan = {};
    plan.a = request.radius;
    if (isProlate()) {
        plan.xi = (wish.xi > 0 ? wish.xi : 1 / (parameter * plan.a));
        const double R = 1 / (plan.xi * plan.a); // of the very number that is reported
        plan.bandwidth = bandwidthFor(R);
        plan.realCutoff =
            (wish.realCutoff > 0 ? wish.realCutoff : plan.a * (R - cutFor(R) + largestDiameter()));
        // and of the cut-off that is reported
        plan.mixture =
            prolateMixture(plan.bandwidth, R, R - (plan.realCutoff / plan.a - largestDiameter()));
    } else {
        plan.xi = (wish.xi > 0 ? wish.xi : parameter / plan.a);
        plan.mixture = hasimotoMixture(plan.xi * plan.a);
        // and of the cut-off that is reported
        const double cutoff = plan.a * plan.mixture->largestRange();
        plan.mixture = std::make_shared<const Mixture>(
            std::make_shared<HasimotoEnvelope>(plan.xi * plan.a,
                                               cutoff / plan.a - largestDiameter()),
            radii);
        plan.realCutoff =
            (wish.realCutoff > 0 ? wish.realCutoff : plan.a * plan.mixture->largestRange());
    }
    completeRealHalf(plan);
    plan.windowSupport = supports().front();
    plan.windowShape = (wish.windowShape > 0 ? wish.windowShape : shapeOf(plan.windowSupport));
    plan.grid = (wish.grid[0] > 0 ? wish.grid : gridFor(FINER * unitOf(plan), plan.windowSupport));
    return plan;
}

Plan MixturePlans::cheapest(double shortest) const {
    const PlanOverrides& wish = request.overrides;
    const bool prolate = isProlate();
    const double given = (prolate ? givenRange() : wish.xi * request.radius);
    if (given > 0)
        return at(given);
    const double width = box.smallestWidth(), smallest = composition.radii.front();
    // From the shortest range on: a wider one only if it is cheaper.
    const double first = (prolate ? SMALLEST_RANGE * smallest : LARGEST_XI / smallest),
                 last = WIDEST_RANGE * width;
    Plan best = {};
    double lowest = std::numeric_limits<double>::infinity();
    for (double x = first; prolate ? x < last || x == first : x > 1 / last;
         x *= prolate ? RANGE_FACTOR : 1 / XI_FACTOR) {
        Plan plan = at(x);
        if (plan.mixture->rangeOfPoints() <= shortest)
            continue;
        double price = cost(plan);
        if (wish.grid[0] > 0) { // it serves only some ranges; else the smallest error is best
            plan = finished(plan, unitOf(plan));
            price = cost(plan);
            if (plan.predictedError > request.tolerance)
                price = plan.predictedError * UNAFFORDABLE;
        }
        if (price < lowest) {
            lowest = price;
            best = plan;
        }
        if (wish.grid[0] == 0 && pairCost(plan.mixture->rangeOfPoints(), false) > lowest)
            break;
    }
    return best;
}

void MixturePlans::requireTolerance(const Plan& plan) const {
    if (request.overrides.grid[0] != 0 || plan.predictedError <= request.tolerance)
        return;
    const double real = realErrorOf(plan);
    std::ostringstream message;
    if (real > 0.5 * request.tolerance && isProlate())
        message << "a prolate bandwidth of " << plan.bandwidth << " leaves an error of " << real
                << " with these radii, the tolerance is " << request.tolerance
                << "; prescribe a larger bandwidth (at most " << ProlateSplit::LARGEST_BANDWIDTH
                << "), or 0 for the automatic one, or loosen the tolerance";
    else if (real > 0.5 * request.tolerance)
        message << "splitting parameter " << plan.xi << " /nm and real-space cutoff "
                << plan.realCutoff << " nm leave an error of " << real
                << " in the real half, the tolerance is " << request.tolerance
                << "; choose a larger splitting parameter or cutoff, or 0 for the automatic ones";
    else
        message << windowRefusal(plan, plan.predictedError);
    throw std::invalid_argument(message.str());
}

std::string MixturePlans::checkTables(Plan& plan) const {
    const MixtureTable table(*plan.mixture, plan.tableError);
    plan.radiusFunctions = (table.interpolates() ? table.size() : 0);
    const double limit = ROUNDING_SHARE * request.tolerance;
    if (SINGLE_ROUNDING * table.magnification() > limit)
        plan.precision = Precision::Double;
    const bool single = request.singleOnly && plan.precision == Precision::Double,
               coarse = !request.directSums && DOUBLE_ROUNDING * table.magnification() > limit;
    if (!single && !coarse)
        return "";
    std::ostringstream message;
    message << "radii from " << composition.radii.front() * plan.a << " to "
            << composition.radii.back() * plan.a << " nm within a range of " << plan.realCutoff
            << " nm make sums of polynomials that magnify rounding by " << table.magnification()
            << ", too much for tolerance " << request.tolerance << " in "
            << (coarse ? "double" : "single") << " precision; "
            << (coarse ? "" : "use the platform's mixed or double precision, ")
            << "use radii that differ less, or a looser tolerance";
    return message.str();
}

Plan MixturePlans::refined(const Plan& plan) const {
    const PlanOverrides& wish = request.overrides;
    if (!isProlate() || wish.bandwidth > 0)
        return plan;
    Plan other = plan;
    const double R = plan.mixture->shape().range(), cut = R - plan.mixture->rangeOfPoints();
    int low = static_cast<int>((plan.bandwidth - BANDWIDTH_BELOW) / BANDWIDTH_STEP),
        high = static_cast<int>((plan.bandwidth + BANDWIDTH_ABOVE) / BANDWIDTH_STEP);
    low = std::max(low, static_cast<int>(ProlateSplit::SMALLEST_BANDWIDTH / BANDWIDTH_STEP) - 1);
    high = std::min(high, static_cast<int>(ProlateSplit::LARGEST_BANDWIDTH / BANDWIDTH_STEP));
    while (high - low > 1) {
        const int mid = (low + high) / 2;
        const auto mixture = prolateMixture(mid * BANDWIDTH_STEP, R, cut);
        (errors.realTruncation(*mixture) <= DROPPED_SHARE * error ? high : low) = mid;
    }
    other.bandwidth = high * BANDWIDTH_STEP;
    other.mixture = prolateMixture(other.bandwidth, R, cut);
    return other;
}

Plan MixturePlans::tightened(const Plan& plan, double shortest) const {
    const PlanOverrides& wish = request.overrides;
    if (!isProlate() || wish.bandwidth > 0 || givenRange() > 0)
        return plan;
    const double allowed = PREDICTED_SHARE / BUDGET * error;
    Plan best = plan;
    double high = plan.mixture->shape().range(), low = high / MOST_TIGHTENING;
    while (high - low > RANGE_PRECISION * high) {
        const double mid = 0.5 * (low + high);
        Plan other = refined(at(mid));
        other.grid = plan.grid;
        other.windowSupport = plan.windowSupport;
        other.windowShape = plan.windowShape;
        predict(other, waveErrorOf(other));
        const bool keeps = other.predictedError <= allowed && other.precision == plan.precision &&
                           other.mixture->rangeOfPoints() > shortest;
        (keeps ? high : low) = mid;
        if (keeps)
            best = other;
    }
    return best;
}

Plan MixturePlans::widened(const Plan& tight, const Plan& plan, double shortest) const {
    const PlanOverrides& wish = request.overrides;
    if (!isProlate() || wish.bandwidth > 0 || givenRange() > 0 || wish.windowSupport > 0 ||
        wish.windowShape > 0 || plan.windowSupport >= LARGEST_SUPPORT || request.directSums)
        return tight;
    Plan wider = plan;
    wider.windowSupport++;
    wider.windowShape = shapeOf(wider.windowSupport);
    const double least = pairCost(plan.mixture->rangeOfPoints() / MOST_TIGHTENING, plan.sumImages),
                 now = pairCost(tight.mixture->rangeOfPoints(), tight.sumImages);
    if (spreadCost(wider) + least >= spreadCost(tight) + now)
        return tight;
    predict(wider, waveErrorOf(wider));
    wider = tightened(wider, shortest);
    const bool serves =
        wider.predictedError <= request.tolerance && wider.precision == tight.precision;
    return serves && cost(wider) < cost(tight) ? wider : tight;
}

Plan MixturePlans::finishedBeyond(double shortest) const {
    Plan plan = cheapest(shortest);
    if (!plan.mixture)
        return plan;
    plan = refined(plan);
    checkPlan(plan, request);
    plan = finished(plan, unitOf(plan));
    plan = widened(tightened(plan, shortest), plan, shortest);
    plan.windowSpacing = RadialWindow::spacing(box, plan.grid);
    plan.splitReason = (request.split == SplitChoice::Automatic ? "default" : "as prescribed");
    requireTolerance(plan);
    return plan;
}

Plan MixturePlans::best() const {
    Plan plan = finishedBeyond(0);
    const std::string obstacle = checkTables(plan);
    std::string left = obstacle;
    while (!left.empty() && !isPrescribed(request.overrides)) {
        // The functions of a longer range vary less over the diameter of the largest sphere.
        plan = finishedBeyond(plan.mixture->rangeOfPoints());
        if (!plan.mixture)
            break;
        left = checkTables(plan);
    }
    if (!left.empty())
        throw std::invalid_argument(obstacle);
    return plan;
}

} // namespace PSE::numerics
