// SPDX-License-Identifier: MIT
#include "Fft.h"
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>

namespace PSE {

namespace {

/**
 * FFTW's planner is the one part of it that is not thread-safe; Contexts may be created in several
 * threads.
 */
std::mutex& plannerLock() {
    static std::mutex lock;
    return lock;
}

template <class Real> typename FftLibrary<Real>::Complex* raw(void* data) {
    return static_cast<typename FftLibrary<Real>::Complex*>(data);
}

} // namespace

template <class Real> void FftArray<Real>::resize(size_t size) {
    FftLibrary<Real>::release(data);
    data = nullptr;
    if (size == 0)
        return;
    data = static_cast<Real*>(FftLibrary<Real>::allocate(size * sizeof(Real)));
    if (data == nullptr)
        throw std::bad_alloc();
}

template <class Real> GridFft<Real>::GridFft(const Layout& layout) {
    using Library = FftLibrary<Real>;
    const int nx = layout.size[0], ny = layout.size[1], nz = layout.size[2], waves = nz / 2 + 1;
    const int row = int(layout.rowLength), line = row / 2, plane = int(layout.planeLength / 2),
              width = layout.blockWidth;
    FftArray<Real> grid(nx * layout.planeLength), other(layout.planeLength), block(2 * nx * width);
    Real *const r = grid.begin(), *const s = other.begin();
    auto *const c = raw<Real>(r), *const t = raw<Real>(s), *const b = raw<Real>(block.begin());
    const auto lines = [&](auto* in, auto* out, int sign) {
        return Library::planComplex(1, &ny, waves, in, NULL, line, 1, out, NULL, line, 1, sign,
                                    FFTW_ESTIMATE);
    };
    std::lock_guard<std::mutex> guard(plannerLock());
    rowForward = Library::planReal(1, &nz, ny, r, NULL, 1, row, t, NULL, 1, line, FFTW_ESTIMATE);
    rowBackward =
        Library::planInverseReal(1, &nz, ny, t, NULL, 1, line, r, NULL, 1, row, FFTW_ESTIMATE);
    lineForward = lines(t, c, FFTW_FORWARD);
    lineBackward = lines(c, t, FFTW_BACKWARD);
    forwardColumn = Library::planComplex(1, &nx, width, c, NULL, plane, 1, b, NULL, width, 1,
                                         FFTW_FORWARD, FFTW_ESTIMATE);
    backwardColumn = Library::planComplex(1, &nx, width, b, NULL, width, 1, c, NULL, plane, 1,
                                          FFTW_BACKWARD, FFTW_ESTIMATE);
    for (Plan missing : all())
        if (missing == NULL) {
            for (Plan plan : all())
                if (plan != NULL)
                    Library::destroy(plan);
            throw std::runtime_error("the FFT library has no plan for a grid of " +
                                     std::to_string(nx) + " x " + std::to_string(ny) + " x " +
                                     std::to_string(nz) + " points; set other grid dimensions");
        }
}

template <class Real> GridFft<Real>::~GridFft() {
    std::lock_guard<std::mutex> guard(plannerLock());
    for (Plan plan : all())
        FftLibrary<Real>::destroy(plan);
}

template <class Real>
void GridFft<Real>::planeForward(Real* plane, Real* scratch, Real* waves) const {
    FftLibrary<Real>::executeReal(rowForward, plane, raw<Real>(scratch));
    FftLibrary<Real>::executeComplex(lineForward, raw<Real>(scratch), raw<Real>(waves));
}

template <class Real> void GridFft<Real>::planeBackward(Real* plane, Real* scratch) const {
    FftLibrary<Real>::executeComplex(lineBackward, raw<Real>(plane), raw<Real>(scratch));
    FftLibrary<Real>::executeInverseReal(rowBackward, raw<Real>(scratch), plane);
}

template <class Real> void GridFft<Real>::columnForward(Real* column, Complex* block) const {
    FftLibrary<Real>::executeComplex(forwardColumn, raw<Real>(column), raw<Real>(block));
}

template <class Real> void GridFft<Real>::columnBackward(Complex* block, Real* column) const {
    FftLibrary<Real>::executeComplex(backwardColumn, raw<Real>(block), raw<Real>(column));
}

template class FftArray<float>;
template class FftArray<double>;
template class GridFft<float>;
template class GridFft<double>;

} // namespace PSE
