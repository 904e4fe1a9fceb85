// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_PLAN_H_
#define OPENMMPSE_NUMERICS_PLAN_H_

// One tolerance becomes numbers here and nowhere else [T11-T16, T22, T23, T44]. Lengths in nm.

#include "numerics/Lattice.h"
#include "numerics/Mixture.h"
#include "numerics/Split.h"
#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace PSE::numerics {

enum class Precision { Single, Double };

enum class SplitChoice {
    Automatic, ///< prolate where valid, unless Hasimoto's is cheaper by more than a few percent
    Prolate,   ///< or a refusal
    Hasimoto,  ///< not for force coupling
    AllWaves   ///< no real half: for force coupling alone
};

/** What a caller may prescribe; zero means automatic. */
struct PlanOverrides {
    /// splitting parameter (1/nm): Hasimoto's, or 1/range of the prolate split
    double xi = 0;
    double realCutoff = 0; ///< nm; of the prolate split its range
    double bandwidth = 0;  ///< c of the prolate split; ignored by Hasimoto's
    std::array<int, 3> grid = {0, 0, 0};
    int windowSupport = 0;
    double windowShape = 0, lanczosTolerance = 0;
};

/** What a Plan depends on. */
struct PlanRequest {
    Lattice box;
    int numParticles; ///< particles that feel the fluid
    double radius;    ///< their hydrodynamic radius a
    double tolerance; ///< allowed relative error of M f
    bool thermal;     ///< whether there will be noise (Lanczos iterations have a price)
    /// smallest tolerance the platform's single precision serves; infinite: always double
    double singleFloor;
    /// the platform sums over modes directly, without a grid (Reference)
    bool directSums;
    PlanOverrides overrides;
    SplitChoice split = SplitChoice::Automatic;
    /// the platform has no double precision to resort to: choose what single precision can do
    bool singleOnly = false;
    /// of each particle; empty if all have `radius`
    std::vector<double> radii = {};
    /// The box will move: platforms follow it with the same Plan, as long as no vector gets longer
    /// than in `box`, and none of the lengths on its diagonal shorter than this factor of that
    /// there.
    bool moving = false;
    double shortest = 1;
    SphereModel model = SphereModel::RotnePragerYamakawa;
};

/** Everything a platform needs to know about the numerics. */
struct Plan {
    std::shared_ptr<const Split> split; ///< in reduced units (lengths in a); NULL for a mixture
    /// unequal radii, in units of a; NULL for equal ones
    std::shared_ptr<const Mixture> mixture;
    /// radius; of a mixture 1/sqrt(mean of 1/a_i^2), so that unit forces have mobilities of 1
    double a;
    std::string splitReason; ///< why this one, in words
    double xi;               ///< splitting parameter (1/nm); of the prolate split 1/range; or 0
    double bandwidth;        ///< c of the prolate split, else 0
    double realCutoff;       ///< range of the real half; 0 where there is none
    /// the range exceeds half the box: sum explicitly over all images
    bool sumImages;
    std::array<int, 3> grid; ///< M_d
    int windowSupport;       ///< P
    double windowShape;      ///< beta
    /// of a mixture: the window is radial, of diameter P times this length (in units of a); else 0
    double windowSpacing;
    /// of a mixture: functions of the radius that pairs are interpolated by; 0: each has its own
    int radiusFunctions;
    double lanczosTolerance; ///< relative error of the real-space noise
    double tableError;       ///< absolute error allowed in tables, 1/(6 pi eta a)
    double windowError;      ///< absolute error allowed in the weights of the window
    /// Root mean square error of M f for unit random forces, 1/(6 pi eta a). Of up to 100 spheres
    /// with what the grid errs by at its worst place, where all may be, unless the mean over places
    /// had to do: see makePlan().
    double predictedError;
    Precision precision;
    /// made for a box that moves: wave factors are made anew, fast, for each shape of it
    bool moving = false;
    double shortest = 1; ///< PlanRequest::shortest

    /** Of the split, whichever there is. */
    std::string splitName() const { return mixture ? mixture->name() : split->name(); }
    /** Whether anything is left for real space: neighbours, pairs, a square root of its own. */
    bool hasRealHalf() const { return realCutoff > 0; }
    /** Number of grid points; double, because a request may exceed any integer. */
    double gridPoints() const { return double(grid[0]) * grid[1] * grid[2]; }
};

/** Whether not all radii are the same. */
bool isMixture(const std::vector<double>& radii);

/**
 * Choose all parameters so that the predicted error for unit random forces at volume fraction
 * max(phi, 0.3) keeps the tolerance (with Hasimoto's split each half at most tolerance/2), at the
 * lowest cost by the model of PlanCost.h. Up to 100 spheres keep it where all are at one place,
 * too, the worst between grid points, if need be in double precision, unless that cannot be had,
 * also with what is prescribed.
 * @throws std::invalid_argument naming what cannot be met
 */
Plan makePlan(const PlanRequest& request);

/**
 * Mean number of neighbours of a particle within a range, images included; double, because it may
 * exceed any integer.
 * @param range  in nm
 */
double meanNeighbours(const Lattice& box, double particles, double range);
/** The same within the range of the Plan, or, in a mixture, of each pair. */
double meanNeighbours(const Plan& plan, const Lattice& box, double particles);

/** Smallest number >= n with no prime factor above 7: sizes that every FFT library does fast. */
int nextFftSize(int n);

/**
 * Root mean square error of the wave half on a grid, for unit random forces at volume fraction phi,
 * in 1/(6 pi eta a): aliases of the window in pairs and in the self mobility, and the modes beyond
 * Nyquist [T14].
 * @param box       in radii
 * @param extent    pairs farther apart (in radii) are left out of the estimate; default: none
 * @param together  the self mobility errs as at the worst place between grid points, relative to
 * this mobility, 1/(6 pi eta a), of spheres that may all be there; 0: as in the mean over places
 */
double waveError(const Split& split, const Lattice& box, const std::array<int, 3>& grid,
                 int windowSupport, double windowShape, double phi,
                 double extent = std::numeric_limits<double>::infinity(), double together = 0);

/**
 * What the wave half makes of small relative errors e of weights and of numbers on the grid: an
 * error of M f of about first e + second e^2, for unit random forces at volume fraction phi, in
 * 1/(6 pi eta a). Each error of a mode is divided by the window's transform once more than forces
 * are: from spreading or from gathering (root mean square), or from both (in the self mobility).
 */
struct Magnification {
    double first, second;
    double of(double error) const { return error * (first + error * second); }
};
/** @param box  in radii */
Magnification magnification(const Split& split, const Lattice& box, const std::array<int, 3>& grid,
                            int windowSupport, double windowShape, double phi);

} // namespace PSE::numerics

#endif
