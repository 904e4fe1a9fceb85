// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_PSEBROWNIANINTEGRATOR_H_
#define OPENMMPSE_PSEBROWNIANINTEGRATOR_H_

#include "openmm/Integrator.h"
#include "openmm/Kernel.h"
#include "openmm/Vec3.h"
#include "openmmpse/internal/windowsExportPSE.h"
#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace PSE {

struct Scene;

/**
 * The numerical parameters behind one tolerance: what a Context really uses, or, given to
 * setNumericalParameters(), what it shall use. A zero (or empty) entry means "automatic".
 * For a free-draining or unbounded fluid xi = 0 and the grid is (0, 0, 0).
 */
struct OPENMM_EXPORT_PSE NumericalParameters {
    /// name of the real/wave split: "Prolate", "Hasimoto" or "AllWaves", or "none" without waves
    std::string split;
    /// splitting parameter (in 1/nm); of the prolate split 1/realCutoff, of unequal spheres 1 over
    /// what is left of it without the two largest radii
    double xi = 0;
    /// range of the real-space half (in nm), of unequal spheres the largest; 0 without that half
    /// (AllWaves)
    double realCutoff = 0;
    /// bandwidth c of the prolate split, in [3, 30] (dimensionless); 0 for another split
    double prolateBandwidth = 0;
    int gridDimensions[3] = {0, 0, 0}; ///< grid points along the three box vectors
    int windowSupport = 0;             ///< grid points per axis that one particle touches, P
    double windowShape = 0;            ///< shape beta of the Kaiser-Bessel window (dimensionless)
    double lanczosTolerance = 0;       ///< relative error of the real-space noise, 2-norm
    int lanczosIterations = 0; ///< iterations of the last thermal step (reported, never set)
    /// the Plan's estimate of the error of M f, relative to |f|/(6 pi eta a) (reported, never set)
    double predictedError = 0;
    /// "single" or "double" arrays for the fluid (reported, never set)
    std::string precision;
    /// instruction set of the loops on the CPU platform, such as "AVX2"; empty elsewhere (reported,
    /// never set)
    std::string instructions;
    /// seed in use; drawn if 0 was asked for (reported; set by setRandomNumberSeed())
    int randomSeed = 0;
    std::string splitReason; ///< why this split, in the words of describe() (never set)
    /// functions of the radius that interpolate pairs of unequal spheres; 0: none do (never set)
    int radiusFunctions = 0;
};

/** Wall-clock time spent in one stage of the steps so far. */
struct OPENMM_EXPORT_PSE StageTime {
    std::string stage;
    double seconds;
};

/**
 * Brownian dynamics of spheres that feel each other through the solvent:
 *
 *     dx = M(x) f dt + sqrt(2 kT M(x)) dW                       [T1]
 *
 * M is the Rotne-Prager-Yamakawa mobility (or another MobilityModel) of a periodic fluid,
 * evaluated by Positively Split Ewald (Fiore, Balboa Usabiaga, Donev, Swan, J. Chem. Phys. 146,
 * 124116 (2017)) at a cost linear in the number of particles. Its divergence vanishes, so the
 * Euler-Maruyama step used here has no drift term; it is of weak order 1 in the step size: halve
 * the step to check a result. Masses do not enter the motion, except that massless particles do not
 * move and are transparent to the fluid. Velocities reported by the Context are displacement / step
 * size.
 *
 * Temperature, step size and shear rate take effect at the next step. Everything else is fixed when
 * a Context is created; setting it later raises an exception.
 */
class OPENMM_EXPORT_PSE PSEBrownianIntegrator : public OpenMM::Integrator {
public:
    /** The mobility M. */
    enum MobilityModel : int {
        /// rigid spheres to the order of the Rotne-Prager-Yamakawa tensor, any overlap
        RotnePragerYamakawa = 0,
        /// the fluctuating force-coupling method: Gaussian envelopes, sigma = a/sqrt(pi), smooth at
        /// every distance; in a periodic fluid one radius for all particles
        ForceCoupling = 1,
        FreeDraining = 2 ///< no hydrodynamic interaction: M = 1/(6 pi eta a)
    };
    /** What surrounds the particles. */
    enum FluidBoundary : int {
        /// periodic if any Force uses periodic boundary conditions, else unbounded
        Automatic = 0,
        Periodic = 1, ///< periodic in the box of the Context, zero mean flow
        /// infinite solvent, by sums over all pairs: the box plays no part, radii may differ, and a
        /// step costs time in proportion to N^2
        Unbounded = 2
    };
    /** How M is divided into a real-space and a wave-space half; none of them shows in M. */
    enum Split : int {
        /// Prolate where the box and the tolerance allow it and Hasimoto (for ForceCoupling:
        /// AllWaves) is not cheaper by the cost model
        AutomaticSplit = 0,
        /// the real half is exactly zero beyond its range R; needs R between 2.4 radii (more for
        /// tolerances below 1e-2) and half the smallest width of the box
        Prolate = 1,
        Hasimoto = 2, ///< the published one, for every box; not for ForceCoupling
        /// no split at all: ForceCoupling by waves alone, for every box; neither neighbours nor
        /// Lanczos iterations
        AllWaves = 3
    };
    /** How the shear rate depends on the time t of the Context. */
    enum ShearProtocol : int {
        SteadyShear = 0,      ///< the shear rate, at all times
        OscillatoryShear = 1, ///< shear rate times cos(2 pi t/period)
        StartUpShear = 2      ///< 0 before a starting time, the shear rate from then on
    };
    /** Parts of the stress of the particles, as bits that can be combined [T46]. */
    enum StressPart : int {
        IdealStress = 1, ///< -n kT, n the number of mobile particles per volume
        /// (1/V) dU/d(strain): of all Forces, with their periodic images
        InterparticleStress = 2,
        /// (20/3) pi eta a^3 E/V of each sphere, E the rate of strain of the flow of setShearRate()
        HydrodynamicStress = 4,
        TotalStress = 7 ///< the sum of all
    };
    /**
     * @param temperature  temperature of the solvent (in Kelvin), >= 0; 0 gives M f dt without
     * noise
     * @param viscosity    shear viscosity of the solvent (in Da/(nm ps)), > 0; 1 mPa s = 602.214
     * Da/(nm ps)
     * @param radius       hydrodynamic radius of every particle without one of its own (in nm), > 0
     * @param stepSize     time step (in ps), > 0
     * @throws OpenMMException if an argument is not finite or outside its range
     */
    PSEBrownianIntegrator(double temperature, double viscosity, double radius, double stepSize);

    /** Get the temperature of the solvent (in Kelvin). */
    double getTemperature() const { return temperature; }
    /** Set the temperature of the solvent (in Kelvin), >= 0. Takes effect at the next step. */
    void setTemperature(double temperature);
    /** Get the shear viscosity of the solvent (in Da/(nm ps)). */
    double getViscosity() const { return viscosity; }
    /** Set the shear viscosity of the solvent (in Da/(nm ps)), > 0. */
    void setViscosity(double viscosity);
    /** Get the default hydrodynamic radius (in nm). */
    double getRadius() const { return radius; }
    /** Set the default hydrodynamic radius (in nm), > 0. */
    void setRadius(double radius);
    /** Set the time step (in ps), > 0. Takes effect at the next step. */
    void setStepSize(double size) override;
    /**
     * Get the hydrodynamic radius of one particle (in nm): its own, else the default.
     * @param index  index of the particle in the System, >= 0
     */
    double getParticleRadius(int index) const;
    /**
     * Give one particle a hydrodynamic radius of its own.
     * @param index   index of the particle in the System, >= 0
     * @param radius  its radius (in nm), from 1e-15 to 1e15
     */
    void setParticleRadius(int index, double radius);
    /**
     * Get the radii that differ from the default by a call of setParticleRadius(): index -> radius
     * (in nm).
     */
    const std::map<int, double>& getParticleRadii() const { return particleRadii; }
    /** Get the relative error allowed in M f and in the covariance of the noise. */
    double getErrorTolerance() const { return tolerance; }
    /**
     * Set the relative error allowed in the mobility: the computed u obeys
     * |u - M f| <= tolerance max(|M f|, |f/(6 pi eta a)|) (2-norms over all particles) for random,
     * uniform and balanced forces, and within 3 tolerance for the worst f there is. The covariance
     * of the noise is that of a mobility that close to M.
     * @param tolerance  dimensionless, in [1e-10, 1e-1]; default 1e-3
     */
    void setErrorTolerance(double tolerance);
    /** Get the mobility model. */
    MobilityModel getMobilityModel() const { return mobilityModel; }
    /** Set the mobility model; default RotnePragerYamakawa. */
    void setMobilityModel(MobilityModel model);
    /** Get what surrounds the particles. */
    FluidBoundary getFluidBoundary() const { return fluidBoundary; }
    /** Set what surrounds the particles; default Automatic. */
    void setFluidBoundary(FluidBoundary boundary);
    /** Get the shear rate of the undisturbed flow (rate*y, 0, 0) (in 1/ps). */
    double getShearRate() const { return shearRate; }
    /**
     * Set the shear rate of the undisturbed flow (rate*y, 0, 0) (in 1/ps), with y the coordinate of
     * a particle as the Context reports it, not wrapped into the box. The box tilts with the flow,
     * b.x and c.x growing by the strain times b.y and c.y, and is brought back to OpenMM's reduced
     * form when the tilt passes one half: the images stay where they were. Takes effect at the next
     * step. On OpenCL and CUDA the System's default box must be tilted.
     */
    void setShearRate(double rate);
    /** Get how the shear rate depends on time. */
    ShearProtocol getShearProtocol() const { return shearProtocol; }
    /** Get the time of the shear protocol (in ps). */
    double getShearTime() const { return shearTime; }
    /**
     * Set how the shear rate depends on the time of the Context; default SteadyShear. A step takes
     * the exact integral of the rate over its length. Takes effect at the next step.
     * @param time  the period of OscillatoryShear (in ps), > 0; the start of StartUpShear (in ps);
     * not used by SteadyShear
     */
    void setShearProtocol(ShearProtocol protocol, double time = 0);
    /** Get the requested split. */
    Split getSplit() const { return split; }
    /**
     * Set how M is divided into its real-space and wave-space half; default AutomaticSplit. With
     * Prolate, a Context in whose box that split is not valid is refused.
     */
    void setSplit(Split split);
    /** Get the requested splitting parameter (in 1/nm); 0 = automatic. */
    double getSplittingParameter() const { return requested.xi; }
    /**
     * Set the splitting parameter xi (in 1/nm), > 0, or 0 for automatic. It moves cost between the
     * halves, not the result. Its meaning is the split's: for Prolate it is 1/range, for Hasimoto
     * that of the published formula. AutomaticSplit takes it as 1/range where that is a valid range
     * of Prolate, else as Hasimoto's; with ForceCoupling it is always 1/range.
     */
    void setSplittingParameter(double xi);
    /** Get the requested grid dimensions; 0 = automatic. */
    void getGridDimensions(int& nx, int& ny, int& nz) const;
    /** Set the grid points along the three box vectors, each > 0, or all 0 for automatic. */
    void setGridDimensions(int nx, int ny, int nz);
    /** Get the requested window support; 0 = automatic. */
    int getWindowSupport() const { return requested.windowSupport; }
    /**
     * Set the grid points per axis that one particle touches, in [3, 16], or 0 for automatic.
     */
    void setWindowSupport(int support);
    /** Get what setNumericalParameters() and the setters above asked for. */
    const NumericalParameters& getRequestedNumericalParameters() const { return requested; }
    /**
     * Reproduce the Plan of another Context: give what its getNumericalParameters() returned.
     * Entries that are zero or empty stay automatic; reported entries (iterations, error,
     * precision) are ignored, a non-zero randomSeed sets the seed.
     */
    void setNumericalParameters(const NumericalParameters& parameters);
    /** Get the requested random number seed; 0 = drawn at Context creation. */
    int getRandomNumberSeed() const { return randomSeed; }
    /**
     * Set the seed of the noise. The same seed, Plan and step give the same noise on every platform
     * and any number of threads. 0 (the default) draws a new one for each Context;
     * getNumericalParameters() tells it.
     */
    void setRandomNumberSeed(int seed);

    /**
     * Advance the simulation by a number of steps. Like the methods below, it may be called by one
     * thread at a time.
     * @throws OpenMMException naming the first non-finite position or force, or a particle that a
     * step which is too long for its force would carry away; that step is not made. Also if another
     * call is under way, or the last checkpoint was refused.
     */
    void step(int steps) override;
    /**
     * Get the velocities M f that given forces cause at the current positions (without shear flow).
     * The trajectory is unchanged.
     * @param forces  one per particle (in kJ/(mol nm)); those on massless particles are ignored
     * @return velocities, one per particle (in nm/ps); zero for massless particles
     */
    std::vector<OpenMM::Vec3> applyMobility(const std::vector<OpenMM::Vec3>& forces);
    /**
     * Draw independent samples of sqrt(2 kT dt M) dW at the current positions. They come from a
     * stream of their own: repeated calls differ, the trajectory and its noise are unchanged. All
     * are zero at temperature 0.
     * @param count  number of samples, >= 0
     * @return count*N displacements, sample by sample (in nm)
     */
    std::vector<OpenMM::Vec3> sampleBrownianDisplacements(int count);
    /**
     * Compute the stress that the particles add to that of the solvent, at the current positions:
     * positive entries mean tension, -trace/3 is their (osmotic) pressure. The interparticle part
     * is a difference of 24 energies at small strains of box and positions, which leave the Context
     * as it is: good to 1e-8 of |U|/V in double precision, 1e-4 elsewhere (the CPU platform, single
     * and mixed precision of devices). A Force that depends on absolute positions has no stress:
     * leave its force group out.
     * @param parts   bits of StressPart; default TotalStress, which is 7
     * @param groups  force groups to include, as bits; those that the integrator leaves out (see
     * setIntegrationForceGroups()) never count
     * @return the three rows of the stress (in kJ/(mol nm^3))
     * @throws OpenMMException if there is no periodic box, or, on OpenCL and CUDA, if the default
     * box is rectangular and the interparticle part is asked for
     */
    std::vector<OpenMM::Vec3> computeStress(int parts = 7, int groups = -1);
    /**
     * Get the strain of all sheared steps so far: the integral of the shear rate over time. It is
     * part of checkpoints and of States with integrator parameters.
     */
    double getStrain() const;
    /** Get the numerical parameters that the Context really uses, and the error they predict. */
    NumericalParameters getNumericalParameters() const;
    /**
     * Get the wall-clock time of each stage of the steps so far (in s), without the Forces: one
     * entry per stage of an active effect, none before the first step. On OpenCL and CUDA a few
     * steps are measured, and only the ratios mean something.
     */
    std::vector<StageTime> getStageTimes() const;
    /**
     * Tell in words which effects are active and why, the parameters in use, and what share of a
     * step each costs.
     */
    std::string describe() const;

protected:
    void initialize(OpenMM::ContextImpl& context) override;
    void cleanup() override;
    std::vector<std::string> getKernelNames() override;
    double computeKineticEnergy() override;
    bool kineticEnergyRequiresForce() const override { return false; }
    void stateChanged(OpenMM::State::DataType changed) override;
    void createCheckpoint(std::ostream& stream) const override;
    void loadCheckpoint(std::istream& stream) override;
    void serializeParameters(OpenMM::SerializationNode& node) const override;
    void deserializeParameters(const OpenMM::SerializationNode& node) override;

private:
    void requireUnbound(const char* setter) const;
    void requireBound(const char* method) const;
    void requirePositions(const char* method) const;
    void requireWhole(const char* method) const;

    double temperature, viscosity, radius;
    double tolerance = 1e-3, shearRate = 0;
    MobilityModel mobilityModel = RotnePragerYamakawa;
    FluidBoundary fluidBoundary = Automatic;
    Split split = AutomaticSplit;
    ShearProtocol shearProtocol = SteadyShear;
    double shearTime = 0;
    int randomSeed = 0;
    std::map<int, double> particleRadii;
    NumericalParameters requested;
    bool positionsSet = false;
    bool halfLoaded = false;            ///< a checkpoint was refused after OpenMM had read its part
    std::atomic<bool> inUse{false};     ///< a call that uses the Context is under way
    std::shared_ptr<const Scene> scene; ///< as it was when the Context was created
    OpenMM::Kernel kernel;
};

} // namespace PSE

#endif
