// SPDX-License-Identifier: MIT
// XML form of PSEBrownianIntegrator: every setting, so that a copy behaves like the original.
// Doubles are written by OpenMM with as many digits as an exact round trip needs.
#include "openmmpse/PSEBrownianIntegrator.h"
#include "openmm/OpenMMException.h"
#include "openmm/serialization/SerializationNode.h"
#include "openmm/serialization/SerializationProxy.h"
#include <memory>
#include <string>
#include <typeinfo>

using namespace OpenMM;

namespace PSE {

namespace {

constexpr int VERSION = 1;
constexpr int ALL_FORCE_GROUPS = -1; // all bits set

void writeRequested(const NumericalParameters& requested, SerializationNode& node) {
    node.setDoubleProperty("xi", requested.xi);
    node.setDoubleProperty("realCutoff", requested.realCutoff);
    node.setDoubleProperty("prolateBandwidth", requested.prolateBandwidth);
    node.setIntProperty("gridX", requested.gridDimensions[0]);
    node.setIntProperty("gridY", requested.gridDimensions[1]);
    node.setIntProperty("gridZ", requested.gridDimensions[2]);
    node.setIntProperty("windowSupport", requested.windowSupport);
    node.setDoubleProperty("windowShape", requested.windowShape);
    node.setDoubleProperty("lanczosTolerance", requested.lanczosTolerance);
}

NumericalParameters readRequested(const SerializationNode& node) {
    NumericalParameters requested;
    requested.xi = node.getDoubleProperty("xi");
    requested.realCutoff = node.getDoubleProperty("realCutoff");
    requested.prolateBandwidth = node.getDoubleProperty("prolateBandwidth", 0);
    requested.gridDimensions[0] = node.getIntProperty("gridX");
    requested.gridDimensions[1] = node.getIntProperty("gridY");
    requested.gridDimensions[2] = node.getIntProperty("gridZ");
    requested.windowSupport = node.getIntProperty("windowSupport");
    requested.windowShape = node.getDoubleProperty("windowShape");
    requested.lanczosTolerance = node.getDoubleProperty("lanczosTolerance");
    return requested;
}

class PSEBrownianIntegratorProxy : public SerializationProxy {
public:
    PSEBrownianIntegratorProxy() : SerializationProxy("PSEBrownianIntegrator") {}

    void serialize(const void* object, SerializationNode& node) const override {
        const auto& integrator = *static_cast<const PSEBrownianIntegrator*>(object);
        node.setIntProperty("version", VERSION);
        node.setDoubleProperty("temperature", integrator.getTemperature());
        node.setDoubleProperty("viscosity", integrator.getViscosity());
        node.setDoubleProperty("radius", integrator.getRadius());
        node.setDoubleProperty("stepSize", integrator.getStepSize());
        node.setDoubleProperty("constraintTolerance", integrator.getConstraintTolerance());
        node.setDoubleProperty("errorTolerance", integrator.getErrorTolerance());
        node.setDoubleProperty("shearRate", integrator.getShearRate());
        node.setIntProperty("shearProtocol", integrator.getShearProtocol());
        node.setDoubleProperty("shearTime", integrator.getShearTime());
        node.setIntProperty("mobilityModel", integrator.getMobilityModel());
        node.setIntProperty("fluidBoundary", integrator.getFluidBoundary());
        node.setIntProperty("split", integrator.getSplit());
        node.setIntProperty("randomSeed", integrator.getRandomNumberSeed());
        node.setIntProperty("integrationForceGroups", integrator.getIntegrationForceGroups());
        writeRequested(integrator.getRequestedNumericalParameters(),
                       node.createChildNode("NumericalParameters"));
        SerializationNode& radii = node.createChildNode("ParticleRadii");
        for (const auto& [index, radius] : integrator.getParticleRadii())
            radii.createChildNode("Particle")
                .setIntProperty("index", index)
                .setDoubleProperty("radius", radius);
    }

    void* deserialize(const SerializationNode& node) const override {
        const int version = node.getIntProperty("version");
        if (version < 1 || version > VERSION)
            throw OpenMMException(
                "PSEBrownianIntegrator: the XML has version " + std::to_string(version) +
                ", but this openmmpse reads up to version " + std::to_string(VERSION) +
                "; install the openmmpse that wrote it, or a newer one");
        auto integrator = std::make_unique<PSEBrownianIntegrator>(
            node.getDoubleProperty("temperature"), node.getDoubleProperty("viscosity"),
            node.getDoubleProperty("radius"), node.getDoubleProperty("stepSize"));
        integrator->setConstraintTolerance(node.getDoubleProperty("constraintTolerance"));
        integrator->setErrorTolerance(node.getDoubleProperty("errorTolerance"));
        integrator->setShearRate(node.getDoubleProperty("shearRate"));
        integrator->setShearProtocol(
            static_cast<PSEBrownianIntegrator::ShearProtocol>(
                node.getIntProperty("shearProtocol", PSEBrownianIntegrator::SteadyShear)),
            node.getDoubleProperty("shearTime", 0));
        integrator->setMobilityModel(static_cast<PSEBrownianIntegrator::MobilityModel>(
            node.getIntProperty("mobilityModel")));
        integrator->setFluidBoundary(static_cast<PSEBrownianIntegrator::FluidBoundary>(
            node.getIntProperty("fluidBoundary")));
        integrator->setNumericalParameters(readRequested(node.getChildNode("NumericalParameters")));
        integrator->setSplit(
            static_cast<PSEBrownianIntegrator::Split>(node.getIntProperty("split")));
        integrator->setRandomNumberSeed(node.getIntProperty("randomSeed"));
        integrator->setIntegrationForceGroups(
            node.getIntProperty("integrationForceGroups", ALL_FORCE_GROUPS));
        for (const SerializationNode& particle : node.getChildNode("ParticleRadii").getChildren())
            integrator->setParticleRadius(particle.getIntProperty("index"),
                                          particle.getDoubleProperty("radius"));
        return integrator.release();
    }
};

/** Makes OpenMM know the proxy as soon as this library is loaded. */
__attribute__((constructor)) void registerProxy() {
    SerializationProxy::registerProxy(typeid(PSEBrownianIntegrator),
                                      new PSEBrownianIntegratorProxy());
}

} // namespace

} // namespace PSE
