// SPDX-License-Identifier: MIT
#include "numerics/AllWaves.h"
#include "numerics/PlanFamily.h"
#include <memory>
#include <optional>
#include <stdexcept>

namespace PSE::numerics {

namespace {

/// what the prolate split must save, by the model of PlanCost.h, before it is preferred to a Plan
/// without pairs and without Lanczos iterations
constexpr double WORTH_A_REAL_HALF = 0.1;

} // namespace

AllWavesPlans::AllWavesPlans(const PlanRequest& request, bool wideWindows, Places places)
    : PlanFamily(request, WAVE_BUDGET, places), wideWindows(wideWindows) {}

std::vector<int> AllWavesPlans::supports() const {
    std::vector<int> all = PlanFamily::supports();
    if (wideWindows && request.overrides.windowSupport == 0)
        for (int wider = 1; wider <= 3; wider++)
            all.push_back(std::min(all[0] + wider, LARGEST_SUPPORT));
    return all;
}

Plan AllWavesPlans::best() const {
    const PlanOverrides& wish = request.overrides;
    if (isPrescribed(wish))
        throw std::invalid_argument(
            "a splitting parameter, a real-space cutoff or a prolate bandwidth is prescribed, and "
            "the split AllWaves has no real half; leave them 0, or use setSplit(Prolate)");
    Plan plan = {};
    plan.split = std::make_shared<const AllWaves>();
    plan.a = request.radius;
    completeRealHalf(plan);
    plan.lanczosTolerance = 0;
    const double unit = plan.split->waveCutoff(error, phi);
    plan.windowSupport = supports()[0];
    plan.windowShape =
        (wish.windowShape > 0 ? wish.windowShape : shapeFor(error, plan.windowSupport));
    plan.grid = (wish.grid[0] > 0 ? wish.grid : gridFor(unit, plan.windowSupport));
    checkPlan(plan, request);
    plan = finished(plan, unit);
    checkPlan(plan, request);
    if (wish.grid[0] == 0 && !(plan.predictedError <= request.tolerance))
        throw std::invalid_argument(windowRefusal(plan, plan.predictedError));
    return plan;
}

namespace {

Plan prolateOr(std::optional<Plan> prolate, const std::string& refusal, const PlanRequest& request,
               const char* reason) {
    if (!prolate)
        throw std::invalid_argument(refusal);
    prolate->splitReason = reason;
    checkPlan(*prolate, request);
    return *prolate;
}

Plan allWavesPlan(const PlanRequest& request, Places places, const std::string& reason) {
    Plan plan = AllWavesPlans(request, true, places).best();
    if (plan.precision == Precision::Double && request.tolerance >= request.singleFloor) {
        // a wide window on a coarse grid magnifies rounding: it is no gain if it costs the
        // precision
        const Plan narrower = AllWavesPlans(request, false, places).best();
        if (narrower.precision == Precision::Single)
            plan = narrower;
    }
    plan.splitReason = reason;
    return plan;
}

} // namespace

Plan makeForceCouplingPlan(const PlanRequest& request, Places places) {
    if (request.split == SplitChoice::Hasimoto)
        throw std::invalid_argument(
            "Hasimoto's split is one of the Rotne-Prager-Yamakawa mobility, and the mobility model "
            "is ForceCoupling; use setSplit(AutomaticSplit), setSplit(Prolate) or "
            "setSplit(AllWaves)");
    if (request.split == SplitChoice::AllWaves)
        return allWavesPlan(request, places, "as prescribed");
    const ProlatePlans family(request, places);
    std::string obstacle;
    std::optional<Plan> prolate = family.best(obstacle);
    if (request.split == SplitChoice::Prolate)
        return prolateOr(prolate,
                         obstacle + ", or another split, setSplit(AutomaticSplit) or "
                                    "setSplit(AllWaves)",
                         request, "as prescribed");
    if (isPrescribed(request.overrides))
        return prolateOr(prolate,
                         obstacle + ", or leave splitting parameter, cutoff and bandwidth 0",
                         request, "because its range is prescribed");
    if (!prolate)
        return allWavesPlan(request, places, "because " + obstacle);
    checkPlan(*prolate, request);
    const bool keeps = prolate->predictedError <= request.tolerance;
    prolate->splitReason = "because the cost model finds neighbours and a coarse grid cheaper here "
                           "than waves alone";
    Plan whole;
    try {
        whole = allWavesPlan(request, places,
                             "because the cost model finds waves alone cheaper here than "
                             "neighbours and a coarser grid");
    } catch (const std::invalid_argument&) {
        if (!keeps)
            throw;
        return *prolate; // there is nothing to compare with
    }
    if (keeps != (whole.predictedError <= request.tolerance))
        return keeps ? *prolate : whole;
    const bool cheaper = family.cost(*prolate) < (1 - WORTH_A_REAL_HALF) * family.cost(whole);
    return cheaper ? *prolate : whole;
}

} // namespace PSE::numerics
