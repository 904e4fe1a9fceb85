// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_PLANFAMILY_H_
#define OPENMMPSE_NUMERICS_PLANFAMILY_H_

// For each split a one-parameter family of Plans that keep the tolerance, and the cheapest of them.
// For makePlan() only.

#include "numerics/Plan.h"
#include "numerics/ProlateSplit.h"
#include <optional>
#include <string>
#include <vector>

namespace PSE::numerics {

/// of the box: below 1/2 nearest images are unique, and there is a margin for rounding
constexpr double LARGEST_LIST_RANGE = 0.499;
/// grid points along one axis; beyond, nothing can be allocated
constexpr double WIDEST_GRID = 32768;

constexpr int LARGEST_SUPPORT = 16; ///< what platforms have room for
/// times the unit of a family: the finest Nyquist wave number at which a grid is sought
constexpr double FINEST = 2.2;

double volumeFraction(const PlanRequest& request);
/** @throws std::invalid_argument naming what cannot be */
void checkPlan(const Plan& plan, const PlanRequest& request);

/** What the families share; lengths in radii inside. */
class PlanFamily {
public:
    virtual ~PlanFamily() = default;
    /** The time of one step by the model of PlanCost.h. */
    double cost(const Plan& plan) const;
    /** The share of the real half in it, for a range (nm) within half the box. */
    double realCost(double range) const;

protected:
    /** @param share  of the tolerance that the wave half may use */
    PlanFamily(const PlanRequest& request, double share);
    double waveErrorOf(const Plan& plan) const;
    /** With M_R, in a step. */
    double products() const;
    /** The smallest grid whose modes reach a Nyquist wave number (1/a) in every direction. */
    std::array<int, 3> gridFor(double nyquist, int support) const;
    /** Everything that follows from split and range alone. */
    void completeRealHalf(Plan& plan) const;
    double realErrorOf(const Plan& plan) const;
    /** Window supports worth trying first: by the rule, and one less on a finer grid. */
    std::vector<int> supports() const;
    /**
     * The same split with the cheapest window and the smallest grid that keep the budget by the
     * full estimate, or come nearest to it, and the error that it predicts.
     * @param unit  the Nyquist wave number (1/a) about which the grid is sought
     */
    Plan finished(const Plan& plan, double unit) const;
    /** That no grid helps this window, in words. */
    std::string windowRefusal(const Plan& plan, double wave) const;

    const PlanRequest& request;
    Lattice box;
    /// error allowed to the wave half, 1/(6 pi eta a)
    double error;
    double meanPhi, phi, extent;

private:
    /** The smallest grid that keeps the budget by the full estimate; false if there is none. */
    bool fitGrid(Plan& plan, double unit, double& wave) const;
    /** Set the predicted error, and the precision that it needs. */
    void predict(Plan& plan, double wave) const;
};

/** Plans with Hasimoto's split, by xi: each half may use half of the tolerance. */
class HasimotoPlans : public PlanFamily {
public:
    explicit HasimotoPlans(const PlanRequest& request);
    Plan best() const;

private:
    /** @param xi  in 1/a */
    Plan at(double xi, double& cost) const;
    void chooseWindow(Plan& plan, double& cost) const;
    /**
     * Window and grid by the full estimate.
     * @throws std::invalid_argument naming what cannot be met
     */
    Plan finishedOrRefused(const Plan& plan) const;
    double nyquistOf(const Plan& plan) const { return plan.split->waveCutoff(error, phi); }
};

/** Plans with the prolate split, by its range R: the real half has no error of its own. */
class ProlatePlans : public PlanFamily {
public:
    explicit ProlatePlans(const PlanRequest& request);
    /**
     * The cheapest.
     * @param obstacle  why there is none, and what would help; "" otherwise
     */
    std::optional<Plan> best(std::string& obstacle) const;

private:
    /** The smallest bandwidth whose dropped waves keep their share; nothing if none does. */
    std::optional<double> bandwidthFor(double R) const;
    bool isValid(double R) const;
    /** The smallest range at which the split is valid at this tolerance; infinite if none is. */
    double smallestRange() const;
    std::string obstacleTo(double R) const;
    std::string missedTolerance(const Plan& plan) const;
    /** Candidate at a range, with the grid of a closed rule. */
    std::optional<Plan> at(double R) const;
};

/**
 * Points whose modes reach the same Nyquist wave number as n points do in the limit of a large box:
 * an even grid has lost its Nyquist plane, which stands for half a mode spacing.
 */
int effectivePoints(int n);
/** Points that a window needs for an error: digits + 2. */
int supportFor(double error);
double shapeFor(double error, int support);

} // namespace PSE::numerics

#endif
