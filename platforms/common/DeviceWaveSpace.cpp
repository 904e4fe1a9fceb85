// SPDX-License-Identifier: MIT
#include "DeviceWaveSpace.h"
#include "DevicePrograms.h"
#include "DeviceRealSpace.h"
#include "numerics/Window.h"

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

namespace {

/** Threads that gather for one particle: a power of two. */
int lanesFor(int support) {
    return support <= 4 ? 4 : (support <= 8 ? 8 : 16);
}

std::vector<double> rowByRow(const Matrix3& m) {
    std::vector<double> entries;
    for (int i = 0; i < 9; i++)
        entries.push_back(m(i / 3, i % 3));
    return entries;
}

/** Points of a half-complex grid. */
size_t numModes(const mm_int4& size) {
    return size_t(size.x) * size.y * (size.z / 2 + 1);
}

} // namespace

DeviceWaveSpace::DeviceWaveSpace(DevicePrograms& programs, const Plan& plan, const Lattice& box,
                                 DevicePlaces& places, DeviceSpheres* spheres)
    : context(programs.context()), places(places),
      size(plan.grid[0], plan.grid[1], plan.grid[2], 0), support(plan.windowSupport),
      lanes(lanesFor(plan.windowSupport)), waves(programs, "pseWaves") {
    if (spheres != nullptr)
        sphereSpread.reset(new DeviceSphereSpread(programs, plan, box, places, *spheres));
    // The transform uses its input as workspace: both need room for complex numbers.
    for (int c = 0; c < 3; c++) {
        grids[c].initialize(context, 2 * numModes(size), realSize(context), "pseGrid");
        modes[c].initialize(context, numModes(size), 2 * realSize(context), "pseModes");
    }
    fft = programs.transform(plan.grid);
    const ComputeProgram program =
        sphereSpread ? sphereSpread->program() : prepareWindow(programs, plan);
    if (plan.moving) {
        prepareMovingFactors(plan);
        makeFactors = DeviceKernel(context, program, "makeFactors");
        setBox(plan, box);
    } else
        prepareFactors(plan, box);
    scaleWaves = DeviceKernel(context, program, "scaleWaves");
}

/** @return the program that its kernels are from */
ComputeProgram DeviceWaveSpace::prepareWindow(DevicePrograms& programs, const Plan& plan) {
    const int n = places.count();
    const std::vector<Polynomial> pieces =
        Window(support, plan.windowShape).polynomials(plan.windowError);
    const int degree = pieces[0].degree();
    std::vector<double> table((degree + 1) * support);
    for (int power = 0; power <= degree; power++)
        for (int j = 0; j < support; j++)
            table[(degree - power) * support + j] = pieces[j].powers[power];
    uploadReals(coefficients, context, table, "pseWindow");
    starts.initialize<mm_int4>(context, n, "pseStarts");
    weights.initialize(context, size_t(3) * support * n, realSize(context), "pseWeights");
    const PlanConstants constants = {
        {"SUPPORT", support}, {"WINDOW_DEGREE", degree}, {"LANES", lanes}};
    uploadConstants(planConstants, context, constants);
    const ComputeProgram program = programs.waveSpace(constants);
    windowKernel = DeviceKernel(context, program, "evaluateWindows");
    spreadForces = DeviceKernel(context, program, "spreadForces");
    gatherVelocities = DeviceKernel(context, program, "gatherVelocities");
    return program;
}

double DeviceWaveSpace::bytesPerGridPoint(const Plan& plan, int realSize) {
    // three grids, three of modes, the factors; a half-complex row has two reals more than points
    const double row = plan.grid[2];
    return realSize * 6.5 * (row + 2) / row;
}

double DeviceWaveSpace::bytesPerParticle(const Plan& plan, int realSize) {
    if (plan.mixture)
        return DeviceSphereSpread::bytesPerParticle(plan, realSize);
    return 3.0 * plan.windowSupport * realSize + sizeof(mm_int4);
}

void DeviceWaveSpace::prepareFactors(const Plan& plan, const Lattice& box) {
    const WaveFactors exact(plan, box);
    std::vector<double> values(numModes(size));
    const int sizeZ = size.z / 2 + 1;
    forEach(context, size.x, [&](int x) {
        for (int y = 0; y < size.y; y++)
            for (int z = 0; z < sizeZ; z++)
                values[(size_t(x) * size.y + y) * sizeZ + z] = exact(x, y, z);
    });
    uploadReals(factors, context, values, "pseFactors");
    waves.set(rowByRow(exact.waves()));
}

void DeviceWaveSpace::prepareMovingFactors(const Plan& plan) {
    moving.reset(new MovingWaveFactors(plan));
    uploadReals(weightPowers, context, moving->weight.powers, "pseWeightPowers");
    std::vector<double> all;
    for (const std::vector<double>& axis : moving->deconvolution)
        all.insert(all.end(), axis.begin(), axis.end());
    uploadReals(deconvolution, context, all, "pseDeconvolution");
    factors.initialize(context, numModes(size), realSize(context), "pseFactors");
}

void DeviceWaveSpace::setBox(const Plan& plan, const Lattice& box) {
    if (sphereSpread)
        sphereSpread->setBox(plan, box);
    waves.set(rowByRow(plan.a * box.waveVectors()));
    scale = moving->scale(box);
    factorsStale = true;
}

void DeviceWaveSpace::followBox(DeviceClock& clock) {
    if (!factorsStale)
        return;
    makeFactors(static_cast<int>(numModes(size)), size, Real{scale}, Real{moving->weight.end2},
                moving->weight.pieces, moving->weight.degree, weightPowers, deconvolution,
                waves.array(), factors);
    factorsStale = false;
    clock.charge(MOVING_BOX);
}

void DeviceWaveSpace::evaluateWindows() {
    if (sphereSpread)
        return; // weights are evaluated where they are used
    const int n = places.count();
    windowKernel(3 * support * n, n, size, planConstants, places.places(), coefficients, starts,
                 weights);
}

void DeviceWaveSpace::spread(ComputeArray& f) {
    if (sphereSpread)
        sphereSpread->spread(f, grids);
    else
        spreadForces(context.getNumThreadBlocks() * GROUP_SIZE, size, places.cells(), planConstants,
                     places.cellStarts(), starts, weights, f, grids[0], grids[1], grids[2]);
}

void DeviceWaveSpace::gather(ComputeArray& u) {
    if (sphereSpread)
        sphereSpread->gather(grids, u);
    else
        gatherVelocities(lanes * places.count(), places.count(), size, planConstants, starts,
                         weights, grids[0], grids[1], grids[2], u);
}

void DeviceWaveSpace::addVelocities(ComputeArray* f, double noise, const NoiseKey& key,
                                    ComputeArray& u, DeviceClock& clock) {
    const int all = context.getNumThreadBlocks() * GROUP_SIZE;
    followBox(clock);
    if (f != NULL) {
        spread(*f);
        clock.charge("spreading");
        for (int c = 0; c < 3; c++)
            fft->execFFT(grids[c], modes[c], true);
        clock.charge("Fourier transforms");
    }
    scaleWaves(all, size, f != NULL ? 1 : 0, Real{noise}, kernelKey(key), waves.array(), factors,
               modes[0], modes[1], modes[2]);
    clock.charge(noise != 0 ? "waves (noise and scaling)" : "waves (scaling)");
    for (int c = 0; c < 3; c++)
        fft->execFFT(modes[c], grids[c], false);
    clock.charge("Fourier transforms");
    gather(u);
    clock.charge("gathering");
}

} // namespace PSE
