// SPDX-License-Identifier: MIT
// The Python face of PSEBrownianIntegrator: the C++ header as it is, with units checked on the way
// in, Quantities on the way out, NumPy arrays for vectors and dicts for numerical parameters.
// step() calls the one inherited from openmm.Integrator, which dispatches virtually and releases the
// GIL.
%module(package="openmmpse") binding

%include "factory.i"
%import(module="openmm") "swig/OpenMMSwigHeaders.i"
%include "swig/typemaps.i"
%include <std_string.i>

%{
#include "bindingSupport.h"
#include "OpenMM.h"
#include "OpenMMAmoeba.h"
#include "OpenMMDrude.h"
#include "openmm/RPMDIntegrator.h"
#include "openmm/RPMDMonteCarloBarostat.h"
#include "openmm/RPMDUpdater.h"
using namespace OpenMM;
using namespace PSE::binding;
%}

%pythoncode %{
import numpy
from openmm import unit
from openmmpse.conversion import (
    STRESS_UNIT, VISCOSITY_UNIT, arrayOfForces, forceGroups, inUnit, integer,
    numericalParameterArguments)
from openmmpse.interruption import inBlocks, keptContext, refusedWithText
%}

// ---- exceptions of C++ become openmm.OpenMMException ----

%exception {
    try {
        $action
    } catch (const std::exception& error) {
        raiseOpenMMException(error);
        SWIG_fail;
    }
}
%define PSE_WITHOUT_GIL(METHOD)
%exception PSE::PSEBrownianIntegrator::METHOD {
    try {
        WithoutGil released;
        $action
    } catch (const std::exception& error) {
        raiseOpenMMException(error);
        SWIG_fail;
    }
}
%enddef
PSE_WITHOUT_GIL(applyMobility)
PSE_WITHOUT_GIL(sampleBrownianDisplacements)
PSE_WITHOUT_GIL(computeStress)

// ---- structures ----

%typemap(out) std::vector<PSE::StageTime> { $result = toDict($1); }

%typemap(out) PSE::NumericalParameters, std::map<int, double> { $result = toDict($1); }
%typemap(out) const PSE::NumericalParameters&, const std::map<int, double>& {
    $result = toDict(*$1);
}
%typemap(in) const PSE::NumericalParameters& (PSE::NumericalParameters parameters) {
    const char* split;
    int* grid = parameters.gridDimensions;
    if (!PyArg_ParseTuple($input, "sddd(iii)iddi", &split, &parameters.xi, &parameters.realCutoff,
            &parameters.prolateBandwidth, &grid[0], &grid[1], &grid[2], &parameters.windowSupport, &parameters.windowShape,
            &parameters.lanczosTolerance, &parameters.randomSeed))
        SWIG_fail;
    parameters.split = split;
    $1 = &parameters;
}
%typemap(out) std::vector<OpenMM::Vec3> { $result = toBytes($1); }
%typemap(in) const std::vector<OpenMM::Vec3>& (std::vector<OpenMM::Vec3> vectors) {
    try {
        vectors = toVectors($input);
    } catch (const std::exception& error) {
        raiseOpenMMException(error);
        SWIG_fail;
    }
    $1 = &vectors;
}
%apply int& OUTPUT { int& nx, int& ny, int& nz };

// ---- units and array shapes ----

%define PSE_QUANTITY(GETTER, SETTER, ARGUMENT, UNIT)
%feature("pythonappend") PSE::PSEBrownianIntegrator::GETTER %{
    val = unit.Quantity(val, UNIT)
%}
%feature("pythonprepend") PSE::PSEBrownianIntegrator::SETTER %{
    ARGUMENT = inUnit(ARGUMENT, UNIT, "ARGUMENT")
%}
%enddef
PSE_QUANTITY(getTemperature, setTemperature, temperature, unit.kelvin)
PSE_QUANTITY(getViscosity, setViscosity, viscosity, VISCOSITY_UNIT)
PSE_QUANTITY(getRadius, setRadius, radius, unit.nanometer)
PSE_QUANTITY(getShearRate, setShearRate, rate, unit.picosecond**-1)
PSE_QUANTITY(getSplittingParameter, setSplittingParameter, xi, unit.nanometer**-1)
PSE_QUANTITY(getStepSize, setStepSize, size, unit.picosecond)

%define PSE_NUMBER(SETTER, ARGUMENT, CONVERSION)
%feature("pythonprepend") PSE::PSEBrownianIntegrator::SETTER %{
    ARGUMENT = CONVERSION
%}
%enddef
PSE_NUMBER(setErrorTolerance, tolerance, inUnit(tolerance, unit.dimensionless, "tolerance"))
PSE_NUMBER(setMobilityModel, model, integer(model, "model"))
PSE_NUMBER(setFluidBoundary, boundary, integer(boundary, "boundary"))
PSE_NUMBER(setSplit, split, integer(split, "split"))
PSE_NUMBER(setWindowSupport, support, integer(support, "support"))
PSE_NUMBER(setRandomNumberSeed, seed, integer(seed, "seed"))
PSE_NUMBER(setNumericalParameters, parameters, numericalParameterArguments(parameters))

%feature("pythonprepend") PSE::PSEBrownianIntegrator::PSEBrownianIntegrator %{
    temperature = inUnit(temperature, unit.kelvin, "temperature")
    viscosity = inUnit(viscosity, VISCOSITY_UNIT, "viscosity")
    radius = inUnit(radius, unit.nanometer, "radius")
    stepSize = inUnit(stepSize, unit.picosecond, "stepSize")
%}
%feature("pythonprepend") PSE::PSEBrownianIntegrator::getParticleRadius %{
    index = integer(index, "index")
%}
%feature("pythonappend") PSE::PSEBrownianIntegrator::getParticleRadius %{
    val = unit.Quantity(val, unit.nanometer)
%}
%feature("pythonprepend") PSE::PSEBrownianIntegrator::setParticleRadius %{
    index = integer(index, "index")
    radius = inUnit(radius, unit.nanometer, "radius")
%}
%feature("pythonappend") PSE::PSEBrownianIntegrator::getParticleRadii %{
    val = {index: unit.Quantity(radius, unit.nanometer) for index, radius in val.items()}
%}
%feature("pythonappend") PSE::PSEBrownianIntegrator::getShearTime %{
    val = unit.Quantity(val, unit.picosecond)
%}
%feature("pythonprepend") PSE::PSEBrownianIntegrator::setShearProtocol %{
    protocol = integer(protocol, "protocol")
    time = inUnit(time, unit.picosecond, "time")
%}
%feature("pythonprepend") PSE::PSEBrownianIntegrator::setGridDimensions %{
    nx, ny, nz = integer(nx, "nx"), integer(ny, "ny"), integer(nz, "nz")
%}
%feature("pythonappend") PSE::PSEBrownianIntegrator::getGridDimensions %{
    val = tuple(val)
%}
%feature("pythonprepend") PSE::PSEBrownianIntegrator::applyMobility %{
    forces, kept = arrayOfForces(forces, self._particleCount()), keptContext(self)
%}
%feature("pythonappend") PSE::PSEBrownianIntegrator::applyMobility %{
    val = numpy.frombuffer(val).reshape(-1, 3)
%}
%rename(_drawn) PSE::PSEBrownianIntegrator::sampleBrownianDisplacements;
%feature("pythonappend") PSE::PSEBrownianIntegrator::sampleBrownianDisplacements %{
    val = numpy.frombuffer(val).reshape(count, self._particleCount(), 3)
%}

%feature("pythonprepend") PSE::PSEBrownianIntegrator::computeStress %{
    parts, groups, kept = integer(parts, "parts"), forceGroups(groups), keptContext(self)
%}
%feature("pythonappend") PSE::PSEBrownianIntegrator::computeStress %{
    val = unit.Quantity(numpy.frombuffer(val).reshape(3, 3), STRESS_UNIT)
%}

%include "docstrings.i"

// ---- the class itself ----

#define OPENMM_EXPORT_PSE
%ignore PSE::NumericalParameters;
%ignore PSE::StageTime;
%ignore PSE::PSEBrownianIntegrator::step;
%feature("notabstract") PSE::PSEBrownianIntegrator;
%include "openmmpse/PSEBrownianIntegrator.h"

%extend PSE::PSEBrownianIntegrator {
    int _particleCount() { return particleCount(*$self); }
    unsigned long long _contextAddress() { return contextAddress(*$self); }
    static bool isinstance(OpenMM::Integrator& integrator) {
        return dynamic_cast<PSE::PSEBrownianIntegrator*>(&integrator) != nullptr;
    }
    static PSE::PSEBrownianIntegrator& _downcast(OpenMM::Integrator& integrator) {
        auto* derived = dynamic_cast<PSE::PSEBrownianIntegrator*>(&integrator);
        if (derived == nullptr)
            throw OpenMMException("PSEBrownianIntegrator.cast() was given another Integrator; "
                                  "ask isinstance() first");
        return *derived;
    }
%pythoncode %{
    def step(self, steps):
        """Advance the simulation by a number of steps.

        Ctrl-C ends it at a whole step, within 0.2 s or the time of one step if that is longer: what
        was done so far is kept, and KeyboardInterrupt is raised, or the script's own handler of
        SIGINT called. The Context lives until the call ends, even if nothing else refers to it any
        more. One thread at a time may use an integrator.
        Source: Fiore et al., J. Chem. Phys. 146, 124116 (2017).

        Parameters
        ----------
        steps : int
            number of steps, each getStepSize() long; none is made if it is not positive

        Raises
        ------
        TypeError
            if steps is not an integer
        openmm.OpenMMException
            naming the first position or force that is not finite, or a particle that a step which
            is too long for its force would carry away; that step is not made. Also if the
            integrator has no Context yet, another call on it is under way, a Force fails, or the
            last checkpoint was refused
        """
        steps, kept = integer(steps, "steps"), keptContext(self)
        with refusedWithText():
            inBlocks(super().step, steps)

    def sampleBrownianDisplacements(self, count):
        """Draw independent samples of sqrt(2 kT dt M) dW at the current positions.

        Their covariance is 2 kT dt M to the tolerance of setErrorTolerance(). They come from a
        stream of random numbers of their own: repeated calls differ, and the trajectory is left as
        it is. Ctrl-C ends it after a whole sample, and the samples so far are lost.
        Source: Fiore et al., J. Chem. Phys. 146, 124116 (2017).

        Parameters
        ----------
        count : int
            number of samples, >= 0

        Returns
        -------
        numpy.ndarray of shape (count, N, 3), float64
            displacement of each particle in each sample (in nm); all zero at temperature 0

        Raises
        ------
        TypeError
            if count is not an integer
        MemoryError
            if there is no room for that many
        openmm.OpenMMException
            if count is negative, the integrator has no Context or no positions yet, a position is
            not finite, another call is under way, or the last checkpoint was refused
        """
        count, kept = integer(count, "count"), keptContext(self)
        if count <= 1:
            return self._drawn(count)
        first = self._drawn(1)
        samples = numpy.empty((count, *first.shape[1:]))
        samples[0] = first
        done = 1

        def draw(more):
            nonlocal done
            samples[done:done + more] = self._drawn(more)
            done += more

        inBlocks(draw, count - 1)
        return samples

    @staticmethod
    def cast(integrator):
        """Get an openmm.Integrator that is a PSEBrownianIntegrator in C++ as one in Python.

        XmlSerializer.deserialize() and CompoundIntegrator.getIntegrator() return plain Integrators.

        Raises
        ------
        openmm.OpenMMException
            if it is another kind of Integrator
        """
        if isinstance(integrator, PSEBrownianIntegrator):
            return integrator
        val = PSEBrownianIntegrator._downcast(integrator)
        if integrator.thisown:
            val.thisown, integrator.thisown = True, False
            integrator._cast = val  # keeps the C++ object alive for both
        else:
            val._source = integrator
        return val

    # OpenMM's copies and pickles hold a pointer to the base class, which no method here accepts.
    def _retyped(self):
        val = PSEBrownianIntegrator._downcast(self)
        val.thisown, self.thisown = True, False
        self.this = val.this
        return self

    def __copy__(self):
        return super().__copy__()._retyped()

    def __setstate__(self, state):
        super().__setstate__(state)
        self._retyped()
%}
}
