// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_MIXTUREERRORS_H_
#define OPENMMPSE_NUMERICS_MIXTUREERRORS_H_

#include "numerics/Lattice.h"
#include "numerics/Mixture.h"
#include "numerics/Plan.h"
#include "numerics/RadialWindow.h"
#include <Eigen/Dense>
#include <array>
#include <vector>

namespace PSE::numerics {

/** A few radii that stand for those of all particles, in estimates of errors and of cost. */
struct Composition {
    static constexpr int MOST = 5;
    std::vector<double> radii; ///< ascending; the first and the last are those of particles
    std::vector<double> counts;

    explicit Composition(const std::vector<double>& particleRadii);
    int size() const { return static_cast<int>(radii.size()); }
    double particles() const;
    /** 4 pi/3 times the sum of the cubes of all radii. */
    double volume() const;
};

/**
 * Root mean square errors of M f for a mixture [T27]. One force of random direction on one particle
 * makes errors in the velocities of all; each estimate is the largest, over all radii, of their
 * norm relative to the particle's own mobility 1/(6 pi eta a_j). So it holds for whatever sizes the
 * forces on the particles have.
 *
 * Lengths in the unit of the Plan.
 */
class MixtureErrors {
public:
    /**
     * @param phi  volume fraction about a particle, of the mixture and also of each kind alone, as
     * in a cluster of its like; at least that of the box counts
     * @param extent  pairs farther apart are left out of the estimate of the grid
     * @param spacing  of the images (see NearImages.h) of one place where any may be, which may be
     * the worst one; 0: as many are at each place, and the mean square counts
     */
    MixtureErrors(const Composition& composition, const Lattice& box, double phi, double extent,
                  double spacing = 0);

    /**
     * What a prolate envelope of the bandwidth drops beyond its end, in pairs; an upper bound,
     * within a factor 2, of what the real half leaves beyond its ranges.
     */
    double dropped(const ProlateEnvelope& envelope) const;
    /** Of all pairs beyond their range. */
    double realTruncation(const Mixture& mixture) const;
    /**
     * Of the wave half on a grid with a window, or of its modes alone (a sum without a grid).
     * @param window  NULL for the latter
     */
    double wave(const Mixture& mixture, const std::array<int, 3>& grid,
                const RadialWindow* window) const;
    /** As numerics::magnification(), of small relative errors of weights and numbers. */
    Magnification magnification(const Mixture& mixture, const std::array<int, 3>& grid,
                                const RadialWindow& window) const;

private:
    /** Sums of squares: of pairs per density of the other kind, and of a particle with itself. */
    struct Parts {
        Eigen::MatrixXd pairs; ///< (other kind, kind of the force)
        Eigen::ArrayXd self;
        Eigen::MatrixXd together; ///< no squares: of two at the worst place; empty if spread
    };
    class Cell;

    Parts none() const;
    double worst(const Parts& parts) const;
    bool together() const { return spacing > 0; }
    /**
     * Square of the error at one place, of all or of one kind alone, for forces on kind j, relative
     * to what they do, in the unit of Parts::self.
     */
    double atOnePlace(const Eigen::MatrixXd& errors, int j) const;
    void addOutside(const Mixture& mixture, const Cell& cell, const RadialWindow* window,
                    Parts& parts) const;
    void addAliases(const Mixture& mixture, const Cell& cell, const RadialWindow& window,
                    Parts& parts) const;

    Composition composition;
    Lattice box;
    double damping, spacing;
    Eigen::ArrayXd radii, mean, dense, alone; ///< number densities
};

} // namespace PSE::numerics

#endif
