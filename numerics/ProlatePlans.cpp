// SPDX-License-Identifier: MIT
#include "numerics/PlanFamily.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>

namespace PSE::numerics {

namespace {

/// of the wave half's budget for the tail of force coupling beyond the range, which adds in squares
constexpr double TAIL_SHARE = 0.3;
/// of that for the dropped waves, the rest for the grid: the cheapest division, and a flat optimum
constexpr double DROPPED_SHARE = 0.6;
/// bandwidths are multiples of this: the same on machines that round differently
constexpr double BANDWIDTH_STEP = 1.0 / 64;
/// from one range to the next: narrow ones, where box and tolerance leave little choice, and wide
constexpr double FINE_FACTOR = 1.04, FACTOR = 1.12;
/// radii: here even the tightest tolerance has a valid range
constexpr double AMPLE_RANGE = 32;

/** Whether xi and cut-off, where both are given, are those of one range. */
bool isOneRange(const PlanOverrides& wish) {
    return wish.xi == 0 || wish.realCutoff == 0 || std::fabs(wish.xi * wish.realCutoff - 1) < 1e-9;
}

/** The wave number up to which H0 is concentrated, in 1/a. */
double unitOf(const Plan& plan) {
    return plan.bandwidth * plan.a / plan.realCutoff;
}

double largestRange(const PlanRequest& request) {
    return LARGEST_LIST_RANGE * narrowestWidth(request);
}

/** The range (nm) up to which there are tables of the real half. */
double resolvedRange(const PlanRequest& request) {
    if (request.model != SphereModel::ForceCoupling)
        return std::numeric_limits<double>::infinity();
    // a prescribed range may cost the precision
    const bool single = request.singleOnly || (request.tolerance >= request.singleFloor &&
                                               !isPrescribed(request.overrides));
    return request.radius *
           (single ? ProlateSplit::SINGLE_RESOLVED : ProlateSplit::DOUBLE_RESOLVED);
}

} // namespace

ProlatePlans::ProlatePlans(const PlanRequest& request, Places places)
    : PlanFamily(request, WAVE_BUDGET, places) {}

std::optional<double> ProlatePlans::bandwidthFor(double R) const {
    if (request.overrides.bandwidth > 0)
        return request.overrides.bandwidth;
    const auto suffices = [&](double c) {
        const ProlateSplit split(c, R, request.model);
        // a zero or negative matching term comes with bandwidths that are too large already
        return split.matching() <= 0 ||
               split.waveTruncation(split.firstZero(), phi) <= DROPPED_SHARE * error;
    };
    int low = static_cast<int>(ProlateSplit::SMALLEST_BANDWIDTH / BANDWIDTH_STEP) - 1,
        high = static_cast<int>(ProlateSplit::LARGEST_BANDWIDTH / BANDWIDTH_STEP);
    if (!suffices(high * BANDWIDTH_STEP))
        return std::nullopt;
    while (high - low > 1) {
        const int mid = (low + high) / 2;
        (suffices(mid * BANDWIDTH_STEP) ? high : low) = mid;
    }
    return high * BANDWIDTH_STEP;
}

bool ProlatePlans::isValid(double R) const {
    const std::optional<double> c = bandwidthFor(R);
    if (!c)
        return false;
    const ProlateSplit split(*c, R, request.model);
    return split.isPositive() && coversTail(split);
}

bool ProlatePlans::coversTail(const ProlateSplit& split) const {
    return split.realTruncation(split.range(), phi, meanPhi) <= TAIL_SHARE * error;
}

double ProlatePlans::smallestRange() const {
    double low = ProlateSplit::SMALLEST_RANGE, high = AMPLE_RANGE;
    if (isValid(low))
        return low;
    if (!isValid(high))
        return std::numeric_limits<double>::infinity();
    while (high - low > 1e-3 * high) {
        const double mid = 0.5 * (low + high);
        (isValid(mid) ? high : low) = mid;
    }
    return high;
}

/** Why a range (radii; 0: a free one) cannot be that of the split, and what would help. */
std::string ProlatePlans::obstacleTo(double R) const {
    std::ostringstream message;
    const double a = request.radius, smallest = a * smallestRange(),
                 largest = largestRange(request);
    if (!isOneRange(request.overrides))
        message << "the prescribed splitting parameter " << request.overrides.xi
                << " /nm and real-space cutoff " << request.overrides.realCutoff
                << " nm are not those of one prolate range (xi = 1/cutoff); prescribe one of them";
    else if (R > 0 && a * R > largest)
        message << "a prolate range of " << a * R << " nm is more than " << LARGEST_LIST_RANGE
                << " of the smallest box width " << narrowestWidth(request)
                << " nm; use a larger splitting parameter (1/range) or a larger box";
    else if (R > 0 && a * R > resolvedRange(request))
        message << "a prolate range of " << a * R << " nm is more than the "
                << resolvedRange(request)
                << " nm that tables of force coupling serve; use a larger splitting parameter "
                   "(1/range)";
    else if (request.overrides.bandwidth > 0)
        message << "a prolate bandwidth of " << request.overrides.bandwidth
                << " makes the real half negative at every range asked for; leave "
                   "prolateBandwidth 0 for the automatic one";
    else if (smallest > largest)
        message << "at tolerance " << request.tolerance
                << " the prolate split needs a range of at least " << smallest
                << " nm, which is more than " << LARGEST_LIST_RANGE << " of the smallest box width "
                << narrowestWidth(request) << " nm; use a larger box or a looser tolerance";
    else
        message << "a prolate range of " << a * R << " nm is below the " << smallest
                << " nm that tolerance " << request.tolerance
                << (request.model == SphereModel::ForceCoupling
                        ? " needs for the Gaussian tail of force coupling; use"
                        : " needs for a positive real half; use")
                << " a smaller splitting parameter (1/range) "
                   "or a looser tolerance";
    return message.str();
}

/** What keeps a Plan with a free grid from the tolerance, and what would help; else "". */
std::string ProlatePlans::missedTolerance(const Plan& plan) const {
    std::ostringstream message;
    const double dropped = plan.split->waveTruncation(FINEST * unitOf(plan), phi);
    if (request.overrides.grid[0] != 0 || plan.predictedError <= request.tolerance)
        return "";
    if (dropped > request.tolerance)
        message << "a prolate bandwidth of " << plan.bandwidth << " leaves an error of " << dropped
                << ", the tolerance is " << request.tolerance
                << "; prescribe a larger bandwidth, or 0 for the automatic one";
    else if (realErrorOf(plan) > request.tolerance)
        message << "a range of " << plan.realCutoff << " nm leaves an error of "
                << realErrorOf(plan) << " beyond it, the tolerance is " << request.tolerance
                << "; prescribe a longer range, or 0 for the automatic one";
    else
        message << windowRefusal(plan, plan.predictedError);
    return message.str();
}

std::optional<Plan> ProlatePlans::at(double R) const {
    const std::optional<double> c = bandwidthFor(R);
    if (!c)
        return std::nullopt;
    const PlanOverrides& wish = request.overrides;
    Plan plan = {};
    plan.a = request.radius;
    plan.realCutoff = (wish.realCutoff > 0 ? wish.realCutoff : R * plan.a);
    plan.xi = (wish.xi > 0 ? wish.xi : 1 / plan.realCutoff);
    plan.bandwidth = *c;
    // of the very quotient that the tables are asked for
    const auto split =
        std::make_shared<const ProlateSplit>(*c, plan.realCutoff / plan.a, request.model);
    if (!split->isPositive() || (wish.bandwidth == 0 && !coversTail(*split)))
        return std::nullopt;
    plan.split = split;
    completeRealHalf(plan);
    std::optional<Plan> cheapest;
    for (int support : supports()) {
        const double digits = -std::log10(error),
                     finer = (support < supportFor(error) ? 1.3 : 1.03 + 0.008 * digits);
        plan.windowSupport = support;
        plan.windowShape = (wish.windowShape > 0 ? wish.windowShape : shapeFor(error, support));
        plan.grid = (wish.grid[0] > 0 ? wish.grid : gridFor(finer * *c / split->range(), support));
        if (!cheapest || cost(plan) < cost(*cheapest))
            cheapest = plan;
    }
    return cheapest;
}

std::optional<Plan> ProlatePlans::best(std::string& obstacle) const {
    const PlanOverrides& wish = request.overrides;
    const double a = request.radius,
                 largest = std::min(largestRange(request), resolvedRange(request)) / a;
    const double given =
        (wish.realCutoff > 0 ? wish.realCutoff / a : (wish.xi > 0 ? 1 / (wish.xi * a) : 0));
    const double smallest = (given > 0 ? given : smallestRange());
    std::optional<Plan> best;
    if (isOneRange(wish) && smallest <= largest) {
        const bool gridGiven = (wish.grid[0] > 0);
        double lowest = std::numeric_limits<double>::infinity();
        for (double R = smallest; R <= largest; R *= R < AMPLE_RANGE ? FINE_FACTOR : FACTOR) {
            std::optional<Plan> plan = at(R);
            if (plan) {
                double price = cost(*plan);
                if (gridGiven) { // it serves only some ranges; else the smallest error is best
                    plan = finished(*plan, unitOf(*plan));
                    price = cost(*plan);
                    if (plan->predictedError > request.tolerance)
                        price = plan->predictedError * 1e100;
                }
                if (price < lowest) {
                    lowest = price;
                    best = plan;
                }
            }
            if (given > 0 || realCost(R * a) > lowest)
                break;
        }
    }
    obstacle = "";
    if (!best) {
        obstacle = obstacleTo(given);
        return best;
    }
    best = finished(*best, unitOf(*best));
    obstacle = missedTolerance(*best);
    return obstacle.empty() ? best : std::nullopt;
}

} // namespace PSE::numerics
