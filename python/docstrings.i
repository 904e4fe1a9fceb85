// SPDX-License-Identifier: MIT
// What help(openmmpse.PSEBrownianIntegrator) says. Methods without an entry here are documented by
// the comments of the C++ header.

%feature("docstring") PSE::PSEBrownianIntegrator %{
Brownian dynamics of spheres that drag each other through the solvent:

    dx = M(x) f dt + sqrt(2 kT M(x)) dW

M is the Rotne-Prager-Yamakawa mobility of a fluid that is periodic in the box of the Context,
evaluated by Positively Split Ewald (Fiore, Balboa Usabiaga, Donev, Swan, J. Chem. Phys. 146,
124116 (2017)) at a cost linear in the number of particles, or of infinite solvent, by sums over all
pairs (setFluidBoundary()); f are the forces of the System, and dW is a Wiener process whose
increments obey fluctuation-dissipation to the same tolerance. Masses do not enter the motion,
except that particles of mass zero neither move nor disturb the fluid. Velocities reported by the
Context are displacement / step size.

The integrator stands where openmm.BrownianIntegrator stood, on every platform of OpenMM that has
its plugin (Reference, CPU, OpenCL, CUDA):

    from openmm import Context, CustomExternalForce, Platform, System, Vec3, unit
    from openmmpse import PSEBrownianIntegrator
    system = System()
    system.setDefaultPeriodicBoxVectors(Vec3(10, 0, 0), Vec3(0, 10, 0), Vec3(0, 0, 10))
    gravity = system.getForce(system.addForce(CustomExternalForce("10*z")))
    for i in range(8):
        gravity.addParticle(system.addParticle(1), [])
    water = 1.002e-3 * unit.pascal * unit.second
    integrator = PSEBrownianIntegrator(293 * unit.kelvin, water, 5 * unit.angstrom, 1.0)  # 1 ps
    integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
    context = Context(system, integrator, Platform.getPlatformByName("CPU"))
    context.setPositions([Vec3(i % 2, i // 2 % 2, i // 4) * 4 for i in range(8)])
    integrator.step(100)
    print(integrator.applyMobility([[0, 0, -10]] * 8)[0], integrator.describe(), sep="\n")

Tolerance: setErrorTolerance() bounds the relative error of M f, and with it that of the covariance
of the noise; splitting, cut-offs, grid, window and Lanczos iterations follow from it. They can be
set one by one and read back with getNumericalParameters().

Warning: the step is the Euler-Maruyama step (M has no divergence, so there is no drift term). Its
error is O(dt): averages are right only in the limit of small steps. Halve the step to check them.

Temperature, step size and shear rate take effect at the next step. Everything else is fixed when a
Context is created: setting it later raises openmm.OpenMMException. Arguments are Quantities, or
plain numbers in OpenMM's units (nm, ps, Da, kJ/mol, K). A Quantity of the wrong dimension raises
TypeError, a value outside its range openmm.OpenMMException; both say what was expected.
%}

%feature("docstring") PSE::PSEBrownianIntegrator::PSEBrownianIntegrator %{
Create an integrator for use in one Context.

Parameters
----------
temperature : Quantity or float
    temperature of the solvent (in kelvin), >= 0; at 0 the motion is M f dt, without noise
viscosity : Quantity or float
    shear viscosity of the solvent (in dalton/(nm ps)), > 0; 1 mPa s = 602.214 dalton/(nm ps)
radius : Quantity or float
    hydrodynamic radius of every particle without one of its own (in nm), > 0
stepSize : Quantity or float
    time step (in ps), > 0

Raises
------
TypeError
    if a Quantity has the wrong dimension or an argument is not a number
openmm.OpenMMException
    if a value is not finite or outside its range
%}

%define PSE_SETTER_DOC(SETTER, ARGUMENT, KIND, SENTENCE, MEANING, WHEN)
%feature("docstring") PSE::PSEBrownianIntegrator::SETTER %{
SENTENCE

Parameters
----------
ARGUMENT : KIND
    MEANING

Raises
------
TypeError
    if it is a Quantity of another dimension, or not a number of the right kind
openmm.OpenMMException
    WHEN
%}
%enddef
%define PSE_GETTER_DOC(GETTER, KIND, SENTENCE, MEANING)
%feature("docstring") PSE::PSEBrownianIntegrator::GETTER %{
SENTENCE

Returns
-------
KIND
    MEANING
%}
%enddef

PSE_GETTER_DOC(getTemperature, Quantity, Get the temperature of the solvent.,
    temperature (in kelvin))
PSE_SETTER_DOC(setTemperature, temperature, Quantity or float,
    Set the temperature of the solvent. It takes effect at the next step.,
    temperature (in kelvin) >= 0; at 0 there is no noise, if it is negative or not finite)
PSE_GETTER_DOC(getViscosity, Quantity, Get the shear viscosity of the solvent.,
    viscosity (in dalton/(nm ps)))
PSE_SETTER_DOC(setViscosity, viscosity, Quantity or float, Set the shear viscosity of the solvent.,
    viscosity (in dalton/(nm ps)) > 0; 1 mPa s = 602.214 dalton/(nm ps),
    if it is not positive and finite or a Context exists)
PSE_GETTER_DOC(getRadius, Quantity,
    Get the hydrodynamic radius of particles without one of their own., radius (in nm))
PSE_SETTER_DOC(setRadius, radius, Quantity or float,
    Set the hydrodynamic radius of particles without one of their own., radius (in nm) > 0,
    if it is not positive and finite or a Context exists)
PSE_SETTER_DOC(setStepSize, size, Quantity or float,
    Set the time step. It takes effect at the next step.,
    time step (in ps) > 0; the error of a step is O(dt), if it is not positive and finite)
PSE_GETTER_DOC(getShearRate, Quantity, Get the shear rate of the undisturbed flow.,
    rate (in 1/ps) of the flow (rate*y 0 0))
PSE_SETTER_DOC(setShearRate, rate, Quantity or float,
    Set the shear rate of the undisturbed flow (rate*y 0 0). It takes effect at the next step; y is
the coordinate that the Context reports. The box tilts with the flow and flips back at half tilt.
On OpenCL and CUDA the default box of the System must be tilted: a small tilt will do.,
    rate (in 1/ps), if it is not finite or the Context cannot be sheared)
PSE_GETTER_DOC(getShearProtocol, int, Get how the shear rate depends on the time of the Context.,
    SteadyShear or OscillatoryShear or StartUpShear)
PSE_GETTER_DOC(getShearTime, Quantity, Get the time of the shear protocol., time (in ps))
%feature("docstring") PSE::PSEBrownianIntegrator::setShearProtocol %{
Set how the shear rate depends on the time t of the Context. It takes effect at the next step.

A step takes the exact integral of the rate over its length.

Parameters
----------
protocol : int
    SteadyShear (the default): the rate of setShearRate() at all times; OscillatoryShear: that times
    cos(2 pi t/time); StartUpShear: none before t = time, that from then on
time : Quantity or float
    period or start (in ps); not used by SteadyShear

Raises
------
TypeError
    if time is a Quantity of another dimension, or protocol not an integer
openmm.OpenMMException
    if the protocol is unknown, the time not finite, or a period not positive
%}
PSE_GETTER_DOC(getStrain, float,
    Get the strain of all sheared steps so far. Checkpoints and States with integrator parameters
hold it., integral of the shear rate over time (dimensionless))
PSE_GETTER_DOC(getErrorTolerance, float,
    Get the relative error allowed in M f and in the covariance of the noise.,
    tolerance (dimensionless))
%feature("docstring") PSE::PSEBrownianIntegrator::setErrorTolerance %{
Set the relative error allowed in the mobility.

The computed velocities u obey |u - M f| <= tolerance max(|M f|, |f/(6 pi eta a)|) for random,
uniform and balanced forces (2-norms over all particles), and stay within 3 tolerance for the worst
forces there are. The covariance of the noise is that of a mobility that close to M.

Parameters
----------
tolerance : float
    dimensionless, from 1e-10 to 1e-1; default 1e-3

Raises
------
TypeError
    if it is not a number
openmm.OpenMMException
    if it is outside that range or a Context exists
%}
PSE_GETTER_DOC(getMobilityModel, int, Get the mobility model.,
    RotnePragerYamakawa or ForceCoupling or FreeDraining)
PSE_SETTER_DOC(setMobilityModel, model, int, Set the mobility model. Default RotnePragerYamakawa.,
    PSEBrownianIntegrator.RotnePragerYamakawa or .ForceCoupling (Gaussian envelopes of width
    a/sqrt(pi); in a periodic fluid one radius for all) or .FreeDraining (no hydrodynamics),
    if it is none of these or a Context exists)
PSE_GETTER_DOC(getFluidBoundary, int, Get what surrounds the particles.,
    Automatic or Periodic or Unbounded)
PSE_SETTER_DOC(setFluidBoundary, boundary, int,
    Set what surrounds the particles. Default Automatic.,
    PSEBrownianIntegrator.Automatic (periodic if any Force is; else unbounded) or .Periodic or
    .Unbounded (infinite solvent by sums over all pairs; no box),
    if it is none of these or a Context exists)
PSE_GETTER_DOC(getSplit, int, Get how M is divided., AutomaticSplit or Prolate or Hasimoto or AllWaves)
PSE_SETTER_DOC(setSplit, split, int,
    Set how M is divided into its real-space and wave-space half. Default AutomaticSplit.,
    PSEBrownianIntegrator.AutomaticSplit (Prolate where it is valid and not dearer) or .Prolate (real
    half exactly zero beyond its range; needs a range of 2.4 radii and more within half the box) or
    .Hasimoto (the published one; any box; not for ForceCoupling) or .AllWaves (no real half at all;
    for ForceCoupling alone; any box), if it is none of these or a Context exists)
PSE_GETTER_DOC(getSplittingParameter, Quantity, Get the requested splitting parameter.,
    xi (in 1/nm); 0 means automatic)
PSE_SETTER_DOC(setSplittingParameter, xi, Quantity or float,
    Set the splitting parameter: it moves cost between the halves of M and leaves the result.,
    xi (in 1/nm) > 0 or 0 for automatic. For Prolate it is 1/range; AutomaticSplit takes it as
    1/range where that is valid and else as that of Hasimoto (ForceCoupling: always as 1/range),
    if it is negative or not finite or a Context exists)
PSE_GETTER_DOC(getGridDimensions, tuple of int, Get the requested grid.,
    points along the three box vectors; (0 0 0) means automatic)
PSE_GETTER_DOC(getWindowSupport, int, Get the requested window support.,
    grid points per axis; 0 means automatic)
PSE_SETTER_DOC(setWindowSupport, support, int,
    Set the grid points per axis that one particle touches., from 3 to 16 or 0 for automatic,
    if it is outside that range or a Context exists)
PSE_GETTER_DOC(getRandomNumberSeed, int, Get the requested seed of the noise.,
    the seed; 0 means one is drawn for each Context (getNumericalParameters() tells which))
PSE_SETTER_DOC(setRandomNumberSeed, seed, int,
    Set the seed of the noise. Any number of threads and any platform gives the same noise for it.,
    the seed; 0 draws a new one for each Context, if a Context exists)

%feature("docstring") PSE::PSEBrownianIntegrator::getParticleRadius %{
Get the hydrodynamic radius of one particle: its own, else the default.

Parameters
----------
index : int
    index of the particle in the System, >= 0

Returns
-------
Quantity
    radius (in nm)

Raises
------
openmm.OpenMMException
    if the index is negative
%}
%feature("docstring") PSE::PSEBrownianIntegrator::setParticleRadius %{
Give one particle a hydrodynamic radius of its own.

Parameters
----------
index : int
    index of the particle in the System, >= 0
radius : Quantity or float
    its radius (in nm), > 0

Raises
------
TypeError
    if the radius is a Quantity of another dimension, or the index not an integer
openmm.OpenMMException
    if the index is negative, the radius not in [1e-15, 1e15] nm, or a Context exists
%}
%feature("docstring") PSE::PSEBrownianIntegrator::getParticleRadii %{
Get the radii that setParticleRadius() set.

Returns
-------
dict
    index of the particle -> Quantity (in nm)
%}
%feature("docstring") PSE::PSEBrownianIntegrator::setGridDimensions %{
Set the grid points along the three box vectors.

Parameters
----------
nx, ny, nz : int
    points along each box vector, all > 0, or all 0 for automatic

Raises
------
TypeError
    if one of them is not an integer
openmm.OpenMMException
    if some but not all are 0, one is negative, or a Context exists
%}

%feature("docstring") PSE::PSEBrownianIntegrator::getNumericalParameters %{
Get the numerical parameters that the Context really uses.

Returns
-------
dict
    split ("Prolate" or "Hasimoto" or "AllWaves" or "none"), xi (in 1/nm; Prolate: 1/realCutoff),
    realCutoff (in nm; 0 for AllWaves, which has no real half), prolateBandwidth (0 for another
    split), gridDimensions (tuple of three int), windowSupport, windowShape, lanczosTolerance,
    lanczosIterations (of the last thermal step), predictedError (of M f, relative to
    |f/(6 pi eta a)|), precision ("single" or "double"),
    instructions (the set that the loops of the CPU platform use, such as "AVX2"; "" elsewhere),
    randomSeed (the one in use). Plain numbers; without hydrodynamic interaction xi is 0 and
    gridDimensions (0, 0, 0).

Raises
------
openmm.OpenMMException
    if the integrator has no Context yet
%}
%feature("docstring") PSE::PSEBrownianIntegrator::getRequestedNumericalParameters %{
Get what setNumericalParameters() and the setters of single parameters asked for.

Returns
-------
dict
    the keys of getNumericalParameters(); 0 or an empty string means automatic
%}
%feature("docstring") PSE::PSEBrownianIntegrator::setNumericalParameters %{
Reproduce the numerical parameters of another Context, on any platform.

Parameters
----------
parameters : dict
    what getNumericalParameters() returned there, or some of its entries. Missing entries, zeros and
    empty strings stay automatic; lanczosIterations, predictedError, precision and instructions are
    ignored; a non-zero randomSeed sets the seed.

Raises
------
ValueError
    if a key is unknown
TypeError
    if a value is of the wrong kind
openmm.OpenMMException
    if a value is outside its range, or a Context exists
%}
%feature("docstring") PSE::PSEBrownianIntegrator::applyMobility %{
Get the velocities M f that given forces cause at the current positions.

The flow of a shear rate is not included, and the trajectory is left as it is. The relative error
is the tolerance of setErrorTolerance(). Source: Fiore et al., J. Chem. Phys. 146, 124116 (2017).

Parameters
----------
forces : array-like of shape (N, 3), or a Quantity of one
    force on each particle (in kJ/(mol nm)); those on massless particles are ignored

Returns
-------
numpy.ndarray of shape (N, 3), float64
    velocity of each particle (in nm/ps); zero for massless ones

Raises
------
ValueError
    if the shape is another one (both are named), or an entry is no number or not finite
TypeError
    if a Quantity is not a force
openmm.OpenMMException
    if the integrator has no Context yet, or a position is not finite
%}
%feature("docstring") PSE::PSEBrownianIntegrator::sampleBrownianDisplacements %{
Draw samples in one call, which cannot be interrupted.
%}
%feature("docstring") PSE::PSEBrownianIntegrator::computeStress %{
Compute the stress that the particles add to that of the solvent, at the current positions.

Positive entries mean tension: a dumbbell stretched along x + y has a positive xy entry, and the
osmotic pressure is -trace/3. The parts: IdealStress, -n kT; InterparticleStress, the derivative of
the potential energy by a strain of the box and everything in it, over the volume, right for every
Force with its periodic images; HydrodynamicStress, the resistance of each single sphere to the flow
of setShearRate(), (20/3) pi eta a^3 E/V with E the rate of strain, zero at rest. There is no other
part: beads carry no stresslets, and M has no divergence. Averages over time divided by the shear
rate give the viscosity that the particles add to the solvent's.

The interparticle part takes 24 energies, good to 1e-8 of |U|/V in double precision (Reference,
devices in double precision) and 1e-4 elsewhere. The Context is left as it is. Forces whose energy
jumps at a cut-off contribute the jumps, too: use a switching function. A Force that depends on
absolute positions has no stress: leave it out by groups.

Parameters
----------
parts : int
    sum of PSEBrownianIntegrator.IdealStress, .InterparticleStress, .HydrodynamicStress;
    default PSEBrownianIntegrator.TotalStress, all three
groups : int or set of int
    force groups to include, as bits or as a set; default all that the integrator uses

Returns
-------
Quantity of a numpy.ndarray of shape (3, 3)
    in kJ/(mol nm^3); 1 of it is 1.66054 MPa

Raises
------
TypeError
    if parts or groups are of the wrong kind
openmm.OpenMMException
    if there is no Context or no periodic box, a position is not finite, a Force has no energy in a
    box strained by up to 0.007, or, on OpenCL and CUDA, the default box is rectangular and the
    interparticle part is asked for
%}
%feature("docstring") PSE::PSEBrownianIntegrator::getStageTimes %{
Get what each stage of the steps so far has cost, without the Forces.

Returns
-------
dict
    stage -> wall-clock time (in s), >= 0, in the order in which stages first ran; only stages of
    active effects, and none before the first step. On OpenCL and CUDA a few steps are measured:
    there only the ratios mean something.

Raises
------
openmm.OpenMMException
    if the integrator has no Context yet
%}
%feature("docstring") PSE::PSEBrownianIntegrator::describe %{
Tell which effects are active and why, the parameters in use and what share of a step each costs.

Returns
-------
str
    several lines of text

Raises
------
openmm.OpenMMException
    if the integrator has no Context yet
%}
%feature("docstring") PSE::PSEBrownianIntegrator::isinstance %{
Tell whether an openmm.Integrator is a PSEBrownianIntegrator in C++, whatever its Python class is.

Parameters
----------
integrator : openmm.Integrator
    for example what XmlSerializer.deserialize() returned

Returns
-------
bool
%}
