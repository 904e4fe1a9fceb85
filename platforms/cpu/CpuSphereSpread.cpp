// SPDX-License-Identifier: MIT
#include "CpuSphereSpread.h"
#include "numerics/GridMetric.h"
#include "numerics/RadialWindow.h"
#include "numerics/WindowRows.h"
#include <algorithm>
#include <cmath>

using namespace PSE::numerics;

namespace PSE {

static_assert(MOST_ROW_TERMS == WindowRows::MOST_TERMS, "every expansion has its loop");
static_assert(SPHERE_LANES == WindowRows::MOST_POINTS, "a row is one vector, or a few");

namespace {

/// places in a grid must be an int32_t there, with what rows and planes are longer for their
/// alignment
constexpr double LARGEST_PLACE = 1e9;

RadialWindow windowOf(const Plan& plan) {
    return RadialWindow(plan.windowSupport, plan.windowShape, plan.windowSpacing);
}

// Not those of <cmath>: calls, on a machine that is not known when this is compiled.
int ceilOf(double x) {
    const int towardsZero = static_cast<int>(x);
    return towardsZero + (towardsZero < x);
}
int nearestTo(double x) {
    return ceilOf(x - 0.5);
}

/** Grid points within `reach` on either side of any centre, at most. */
int extentOf(double reach) {
    return static_cast<int>(2 * reach) + 1;
}

} // namespace

template <class Real> int CpuSphereSpread<Real>::paddingOf(const Plan& plan, const Lattice& box) {
    const double reach = windowOf(plan).reach(plan.mixture->radii().back());
    // the third width is c.z in every box: if the box moves, it can become this much shorter
    const double points = GridMetric(box, plan.grid, plan.a).pointsPerLength[2] / plan.shortest;
    return extentOf(reach * points) + SPHERE_LANES;
}

template <class Real> double CpuSphereSpread<Real>::bytesPerParticle(const Plan& plan) {
    const double shapes = double(plan.mixture->radii().size()) /
                          std::max<size_t>(1, plan.mixture->particleRadii().size());
    return (6 + MOST_ROW_TERMS * SPHERE_LANES) * sizeof(Real) + 7 * sizeof(int) +
           sizeof(SphereChords) +
           shapes * (sizeof(SphereShape<Real>) + sizeof(double) +
                     (RadialWindow::MAX_DEGREE + 1) * sizeof(Real));
}

template <class Real>
CpuSphereSpread<Real>::CpuSphereSpread(const Plan& plan, const Lattice& box, const Threads& threads)
    : Base(plan.grid, paddingOf(plan, box)), a(plan.a) {
    const std::vector<double>& radii = plan.mixture->radii();
    for (double radius : plan.mixture->particleRadii())
        shapeOf.push_back(
            static_cast<int>(std::lower_bound(radii.begin(), radii.end(), radius) - radii.begin()));
    makeShapes(plan, threads);
    makeRows(plan, threads);
    setBox(box);
}

template <class Real> void CpuSphereSpread<Real>::setBox(const Lattice& box) {
    const GridMetric metric(box, {size[0], size[1], size[2]}, a);
    for (int d = 0; d < 3; d++)
        pointsPerLength[d] = metric.pointsPerLength[d];
    plane = Real(metric.plane);
    line = Real(metric.line);
    point = Real(metric.point);
    skewY = Real(metric.skewY);
    skewX = Real(metric.skewX);
    skewZ = Real(metric.skewZ);
    widest = 0;
    const double mostPlaces = double(size[0]) * size[1] * (size[2] + padded);
    for (size_t i = 0; i < shapes.size(); i++) {
        for (int d = 0; d < 3; d++)
            shapes[i].extent[d] = extentOf(reach[i] * pointsPerLength[d]);
        widest = std::max(widest, shapes[i].extent[0]);
        const int* const extent = shapes[i].extent;
        const bool fits = *std::max_element(extent, extent + 3) <= SPHERE_LANES &&
                          size[1] >= SPHERE_LANES && mostPlaces < LARGEST_PLACE,
                   oblique = skewX != 0 || skewZ != 0;
        shapes[i].rowScale = (fits && !oblique ? rowScale[i] : Real(0));
    }
}

template <class Real>
void CpuSphereSpread<Real>::makeShapes(const Plan& plan, const Threads& threads) {
    const std::vector<double>& radii = plan.mixture->radii();
    const RadialWindow window = windowOf(plan);
    std::vector<SphereKernel> kernels(radii.size());
    threads.runBlocks(static_cast<int>(radii.size()), [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            kernels[i] = window.kernel(radii[i], plan.windowError);
    });
    for (const SphereKernel& kernel : kernels)
        degree = std::max(degree, kernel.polynomial.degree());
    coefficients.assign(radii.size() * (degree + 1), Real(0));
    for (size_t i = 0; i < radii.size(); i++) {
        const SphereKernel& kernel = kernels[i];
        // Without a hollow, rounding must not lose the centre itself, t = -1.
        const Real least = kernel.inner > 0 ? Real(-1) : Real(-2);
        SphereShape<Real> shape = {Real(kernel.scale), Real(kernel.shift), least, {}, Real(0)};
        reach.push_back(kernel.reach);
        shapes.push_back(shape);
        const std::vector<double>& powers = kernel.polynomial.powers;
        for (size_t p = 0; p < powers.size(); p++)
            coefficients[i * (degree + 1) + degree - p] = Real(powers[p]);
    }
}

/** Rows of the radii that a few products serve. */
template <class Real>
void CpuSphereSpread<Real>::makeRows(const Plan& plan, const Threads& threads) {
    const std::vector<double>& radii = plan.mixture->radii();
    const size_t n = radii.size();
    rowScale.assign(n, Real(0));
    if (n > WindowRows::MOST_SHAPES || plan.windowError < WindowRows::SMALLEST_ERROR)
        return;
    const RadialWindow window = windowOf(plan);
    std::vector<WindowRows> rows(n);
    threads.run(static_cast<int>(n),
                [&](int i, int) { rows[i] = windowRows(window, radii[i], plan.windowError); });
    for (const WindowRows& own : rows) {
        rowTerms = std::max(rowTerms, own.terms());
        rowDegree = std::max(rowDegree, own.degree());
    }
    const size_t size = size_t(rowDegree + 1) * rowTerms;
    across.assign(n * size, Real(0));
    along.assign(n * size, Real(0));
    for (size_t i = 0; i < n; i++) {
        if (rows[i].terms() > 0)
            rowScale[i] = Real(rows[i].scale);
        for (int j = 0; j < rows[i].terms(); j++)
            for (int p = 0; p <= rows[i].degree(); p++) {
                const size_t at = i * size + size_t(rowDegree - p) * rowTerms + j;
                across[at] = Real(rows[i].across[j].powers[p]);
                along[at] = Real(rows[i].along[j].powers[p]);
            }
    }
}

template <class Real> void CpuSphereSpread<Real>::begin(int particles) {
    Base::begin(particles);
    offset.resize(3 * size_t(particles));
    placedShape.resize(particles);
    if (along.empty())
        return;
    chords.resize(particles);
    alongWeights.resize(size_t(particles) * rowTerms * SPHERE_LANES);
}

/** The lowest coordinate that a sphere at u reaches to along axis d, in grid points. */
template <class Real> double CpuSphereSpread<Real>::lowest(int shape, int d, double u) const {
    return u - reach[shape] * pointsPerLength[d];
}

/** The grid point in the box of a point that is not far outside. */
template <class Real> int CpuSphereSpread<Real>::wrapped(int d, int i) const {
    while (i < 0)
        i += size[d];
    while (i >= size[d])
        i -= size[d];
    return i;
}

template <class Real>
void CpuSphereSpread<Real>::assign(const std::vector<Vec3>& fractions, int from, int to) {
    const auto firstPoint = [&](int i, int d) {
        return wrapped(d, ceilOf(lowest(shapeOf[i], d, fractions[i][d] * size[d])));
    };
    for (int i = from; i < to; i++)
        this->setColumn(i, firstPoint(i, 0), firstPoint(i, 1));
}

template <class Real>
void CpuSphereSpread<Real>::place(const std::vector<Vec3>& fractions, int from, int to) {
    for (int slot = from; slot < to; slot++) {
        const int particle = order[slot], shape = shapeOf[particle];
        int* const mine = first.data() + 3 * size_t(slot);
        placedShape[slot] = shape;
        for (int d = 0; d < 3; d++) {
            const double u = fractions[particle][d] * size[d], low = lowest(shape, d, u);
            // Along x and y the point that assign() found, in the image where it was found.
            mine[d] = (d == 0   ? this->columnX(particle)
                       : d == 1 ? this->columnY(particle)
                                : wrapped(2, ceilOf(low)));
            const int image = nearestTo((low - mine[d]) / size[d]);
            offset[3 * size_t(slot) + d] = Real(mine[d] + size[d] * image - u);
        }
    }
    if (!along.empty())
        loops.weighRows(spheres(), from, to, chords.data(), alongWeights.data());
}

template <class Real> GridSpheres<Real> CpuSphereSpread<Real>::spheres() const {
    return {{size[0], size[1], size[2]},
            padded,
            widest,
            rowLength,
            planeLength,
            columnStart.data(),
            first.data(),
            offset.data(),
            placedShape.data(),
            shapes.data(),
            degree,
            coefficients.data(),
            plane,
            line,
            point,
            skewY,
            skewX,
            skewZ,
            sorted.data(),
            rowTerms,
            rowDegree,
            across.data(),
            along.data(),
            chords.data(),
            alongWeights.data()};
}

template <class Real>
void CpuSphereSpread<Real>::spreadPlanes(int x, int number, Real* const planes[3]) const {
    loops.spreadPlanes(spheres(), x, number, planes);
}

template <class Real>
void CpuSphereSpread<Real>::gather(const Real* const grids[3], int from, int to) {
    loops.gatherVelocities(spheres(), from, to, grids, sorted.data());
}

template class CpuSphereSpread<float>;
template class CpuSphereSpread<double>;

} // namespace PSE
