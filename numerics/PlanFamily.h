// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_PLANFAMILY_H_
#define OPENMMPSE_NUMERICS_PLANFAMILY_H_

// For each split a one-parameter family of Plans that keep the tolerance, and the cheapest of them.
// For makePlan() only.

#include "numerics/MixtureErrors.h"
#include "numerics/Plan.h"
#include "numerics/ProlateSplit.h"
#include "numerics/Quadrature.h"
#include <optional>
#include <string>
#include <vector>

namespace PSE::numerics {

/// of the box: below 1/2 nearest images are unique, and there is a margin for rounding
constexpr double LARGEST_LIST_RANGE = 0.499;
/// grid points along one axis; beyond, nothing can be allocated
constexpr double WIDEST_GRID = 32768;

/// of the tolerance for the wave half where it has all the error there is. Measured errors reach
/// 0.85 of the estimate for uniform forces.
constexpr double WAVE_BUDGET = 0.9;
constexpr int LARGEST_SUPPORT = 16; ///< what platforms have room for
/// times the unit of a family: the finest Nyquist wave number at which a grid is sought
constexpr double FINEST = 2.2;

double volumeFraction(const PlanRequest& request);
/** Of the smallest box that the Plan must serve, in nm. */
double narrowestWidth(const PlanRequest& request);
/** @throws std::invalid_argument naming what cannot be */
void checkPlan(const Plan& plan, const PlanRequest& request);
/** Whether the caller has left so little open that the splits cannot be compared. */
bool isPrescribed(const PlanOverrides& wish);
/** What estimates of errors know of the places of spheres between grid points. */
enum class Places {
    Spread,       ///< as many at each: the mean square counts
    Together,     ///< all may be at one, which may be the worst
    TogetherSteep ///< the same, with windows that fall faster towards their edge on the same points
};

/** makePlan() for force coupling [T44]. */
Plan makeForceCouplingPlan(const PlanRequest& request, Places places);

/** What the families share; lengths in radii inside. */
class PlanFamily {
public:
    virtual ~PlanFamily() = default;
    /** The time of one step by the model of PlanCost.h. */
    virtual double cost(const Plan& plan) const;
    /** The share of the real half in it, for a range (nm) within half the box. */
    virtual double realCost(double range) const;

protected:
    /** @param share  of the tolerance that the wave half may use */
    PlanFamily(const PlanRequest& request, double share, Places places);
    virtual double waveErrorOf(const Plan& plan) const;
    /** With M_R, in a step. */
    double products() const;
    /** The smallest grid whose modes reach a Nyquist wave number (1/a) in every direction. */
    std::array<int, 3> gridFor(double nyquist, int support) const;
    /** Everything that follows from split and range alone. */
    void completeRealHalf(Plan& plan) const;
    virtual double realErrorOf(const Plan& plan) const;
    /** What the wave half makes of small errors of weights and of numbers on the grid. */
    virtual Magnification magnificationOf(const Plan& plan) const;
    /** Window supports worth trying first: by the rule, and one less on a finer grid. */
    virtual std::vector<int> supports() const;
    virtual double shapeOf(int support) const;
    /**
     * The same split with the cheapest window and the smallest grid that keep the budget by the
     * full estimate, or come nearest to it, and the error that it predicts.
     * @param unit  the Nyquist wave number (1/a) about which the grid is sought
     */
    Plan finished(const Plan& plan, double unit) const;
    /** Set the predicted error, and the precision that it needs. */
    void predict(Plan& plan, double wave) const;
    /** That no grid helps this window, in words. */
    std::string windowRefusal(const Plan& plan, double wave) const;

    /** Of one place where all may be, as near as they come in boxes that the Plan must serve. */
    double imageSpacing() const;

    const PlanRequest& request;
    Lattice box;
    /// error allowed to the wave half, 1/(6 pi eta a)
    double error;
    double meanPhi, phi, extent;
    Places places;

private:
    /** What an error at one place is relative to, as waveError() takes it. */
    double together() const;
    /** The error that windows are made for: `error`, or what may be the mean over places then. */
    double windowError() const;
    /** The smallest grid that keeps the budget by the full estimate; false if there is none. */
    bool fitGrid(Plan& plan, double unit, double& wave) const;
};

/** Plans with Hasimoto's split, by xi: each half may use half of the tolerance. */
class HasimotoPlans : public PlanFamily {
public:
    HasimotoPlans(const PlanRequest& request, Places places);
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

/** The one Plan of force coupling without a split. */
class AllWavesPlans : public PlanFamily {
public:
    /**
     * @param wideWindows  also those that bear coarser grids: points are what costs here
     */
    AllWavesPlans(const PlanRequest& request, bool wideWindows, Places places);
    /** @throws std::invalid_argument naming what cannot be met */
    Plan best() const;

protected:
    std::vector<int> supports() const override;

private:
    bool wideWindows;
};

/**
 * Plans with the prolate split, by its range R: the real half has no error of its own, but for the
 * tail of force coupling.
 */
class ProlatePlans : public PlanFamily {
public:
    ProlatePlans(const PlanRequest& request, Places places);
    /**
     * The cheapest.
     * @param obstacle  why there is none, and what would help; "" otherwise
     */
    std::optional<Plan> best(std::string& obstacle) const;

private:
    /** The smallest bandwidth whose dropped waves keep their share; nothing if none does. */
    std::optional<double> bandwidthFor(double R) const;
    /** Whether what force coupling leaves beyond a range is little beside the tolerance. */
    bool coversTail(const ProlateSplit& split) const;
    bool isValid(double R) const;
    /** The smallest range at which the split is valid at this tolerance; infinite if none is. */
    double smallestRange() const;
    std::string obstacleTo(double R) const;
    std::string missedTolerance(const Plan& plan) const;
    /** Candidate at a range, with the grid of a closed rule. */
    std::optional<Plan> at(double R) const;
};

/**
 * Plans for unequal radii, all with one envelope [T28]: of a prolate one by its range R, where a
 * pair has the range R + ai + aj, of Hasimoto's by xi. Real half and wave half are positive
 * whatever range and bandwidth are.
 */
class MixturePlans : public PlanFamily {
public:
    /**
     * @param request  with radii, and unitRadius() of them as radius
     */
    MixturePlans(const PlanRequest& request, Places places);
    /** 1/sqrt(mean of 1/a_i^2): unit forces have mobilities of 1 in units of 1/(6 pi eta a). */
    static double unitRadius(const std::vector<double>& radii);
    /**
     * The cheapest.
     * @throws std::invalid_argument naming what cannot be met
     */
    Plan best() const;
    double cost(const Plan& plan) const override;

protected:
    double waveErrorOf(const Plan& plan) const override;
    double realErrorOf(const Plan& plan) const override;
    Magnification magnificationOf(const Plan& plan) const override;
    double shapeOf(int support) const override;

private:
    bool isProlate() const { return request.split != SplitChoice::Hasimoto; }
    RadialWindow windowOf(const Plan& plan) const;
    double pairsOf(double range, bool sumImages) const;
    // parts of cost():
    double spreadCost(const Plan& plan) const;
    double pairCost(double range, bool sumImages) const;
    double largestDiameter() const { return 2 * composition.radii.back(); }
    /** R of what is prescribed; 0 if nothing is. */
    double givenRange() const;
    /** The smallest bandwidth whose dropped waves keep their share; a rule, to rank ranges by. */
    double bandwidthFor(double R) const;
    /** The cut of a mixture: what is left there is little beside what the envelope drops. */
    double cutFor(double R) const;
    std::shared_ptr<const Mixture> prolateMixture(double bandwidth, double R, double cut) const;
    /** The same with the smallest bandwidth for which the pairs beyond their ranges keep their
     * share. */
    Plan refined(const Plan& plan) const;
    /**
     * With the shortest range that keeps the tolerance on the grid that the plan has; that of point
     * forces stays beyond `shortest`.
     */
    Plan tightened(const Plan& plan, double shortest) const;
    /**
     * `tight`, or what is cheaper: a wider window on the same grid, which leaves more of the error
     * to a shorter range.
     * @param plan  before it was tightened
     */
    Plan widened(const Plan& tight, const Plan& plan, double shortest) const;
    std::shared_ptr<const Mixture> hasimotoMixture(double xi) const;
    /** Candidate with a prolate range R, or Hasimoto's xi, and the grid of a closed rule. */
    Plan at(double parameter) const;
    double unitOf(const Plan& plan) const;
    /** Of ranges of point forces beyond `shortest`; without a mixture if there is none. */
    Plan cheapest(double shortest) const;
    void requireTolerance(const Plan& plan) const;
    /**
     * Set the arithmetic that the tables need.
     * @return why none that the platform has suffices; "" if one does
     */
    std::string checkTables(Plan& plan) const;
    /** The cheapest one, finished; its tables are not looked at. */
    Plan finishedBeyond(double shortest) const;

    Composition composition;
    std::vector<double> radii; ///< of particles, in the unit
    MixtureErrors errors;
};

/**
 * Points whose modes reach the same Nyquist wave number as n points do in the limit of a large box:
 * an even grid has lost its Nyquist plane, which stands for half a mode spacing.
 */
int effectivePoints(int n);
/** Points that a window needs for an error: digits + 2. */
int supportFor(double error);
double shapeFor(double error, int support);

/**
 * Quadrature over theta in [-pi, pi], symmetric, with nodes crowded at 0, where the wave factor of
 * a large box is peaked and plain Gauss-Legendre nodes are too far apart.
 */
Quadrature gradedBand(int nodes);
/**
 * Square of the wave number that stands for the missing mode k = 0 in estimates of sums over modes,
 * and for those that pairs nearer than the extent do not tell from it [T14].
 */
double missingModes(const Lattice& box, double extent);

} // namespace PSE::numerics

#endif
