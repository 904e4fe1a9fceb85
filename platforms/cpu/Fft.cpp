// SPDX-License-Identifier: MIT
#include "Fft.h"
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

template <class Real>
GridFft<Real>::GridFft(int nx, int ny, int nz, size_t rowLength, size_t blockLength) {
    using Library = FftLibrary<Real>;
    const int planeSize[2] = {ny, nz}, realRows[2] = {ny, int(rowLength)},
              complexRows[2] = {ny, int(rowLength / 2)};
    const int waves = nz / 2 + 1, stride = ny * int(rowLength / 2);
    FftArray<Real> grid(size_t(nx) * ny * rowLength), block(2 * nx * blockLength);
    std::lock_guard<std::mutex> guard(plannerLock());
    forwardPlane = Library::planReal(2, planeSize, 1, grid.begin(), realRows, 1, 0,
                                     raw<Real>(grid.begin()), complexRows, 1, 0, FFTW_ESTIMATE);
    backwardPlane = Library::planInverseReal(2, planeSize, 1, raw<Real>(grid.begin()), complexRows,
                                             1, 0, grid.begin(), realRows, 1, 0, FFTW_ESTIMATE);
    forwardColumn = Library::planComplex(1, &nx, waves, raw<Real>(grid.begin()), NULL, stride, 1,
                                         raw<Real>(block.begin()), NULL, int(blockLength), 1,
                                         FFTW_FORWARD, FFTW_ESTIMATE);
    backwardColumn = Library::planComplex(1, &nx, waves, raw<Real>(block.begin()), NULL,
                                          int(blockLength), 1, raw<Real>(grid.begin()), NULL,
                                          stride, 1, FFTW_BACKWARD, FFTW_ESTIMATE);
    for (auto plan : {forwardPlane, backwardPlane, forwardColumn, backwardColumn})
        if (plan == NULL)
            throw std::runtime_error("the FFT library has no plan for a grid of " +
                                     std::to_string(nx) + " x " + std::to_string(ny) + " x " +
                                     std::to_string(nz) + " points; set other grid dimensions");
}

template <class Real> GridFft<Real>::~GridFft() {
    std::lock_guard<std::mutex> guard(plannerLock());
    for (auto plan : {forwardPlane, backwardPlane, forwardColumn, backwardColumn})
        FftLibrary<Real>::destroy(plan);
}

template <class Real> void GridFft<Real>::planeForward(Real* plane) const {
    FftLibrary<Real>::executeReal(forwardPlane, plane, raw<Real>(plane));
}

template <class Real> void GridFft<Real>::planeBackward(Real* plane) const {
    FftLibrary<Real>::executeInverseReal(backwardPlane, raw<Real>(plane), plane);
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
