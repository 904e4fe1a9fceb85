// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_FFT_H_
#define OPENMMPSE_FFT_H_

// The only place that speaks to an FFT library, through the interface of FFTW 3 (which MKL offers
// too). Plans are serial and made by estimate, never by timing: the same plan on every run and for
// any number of threads, so the same bits.

#include <array>
#include <complex>
#include <cstddef>
#include <fftw3.h>

namespace PSE {

template <class Real> struct FftLibrary;

template <> struct FftLibrary<float> {
    using Plan = fftwf_plan;
    using Complex = fftwf_complex;
    static constexpr auto planReal = fftwf_plan_many_dft_r2c;
    static constexpr auto planInverseReal = fftwf_plan_many_dft_c2r;
    static constexpr auto planComplex = fftwf_plan_many_dft;
    static constexpr auto executeReal = fftwf_execute_dft_r2c;
    static constexpr auto executeInverseReal = fftwf_execute_dft_c2r;
    static constexpr auto executeComplex = fftwf_execute_dft;
    static constexpr auto destroy = fftwf_destroy_plan;
    static constexpr auto allocate = fftwf_malloc;
    static constexpr auto release = fftwf_free;
};

template <> struct FftLibrary<double> {
    using Plan = fftw_plan;
    using Complex = fftw_complex;
    static constexpr auto planReal = fftw_plan_many_dft_r2c;
    static constexpr auto planInverseReal = fftw_plan_many_dft_c2r;
    static constexpr auto planComplex = fftw_plan_many_dft;
    static constexpr auto executeReal = fftw_execute_dft_r2c;
    static constexpr auto executeInverseReal = fftw_execute_dft_c2r;
    static constexpr auto executeComplex = fftw_execute_dft;
    static constexpr auto destroy = fftw_destroy_plan;
    static constexpr auto allocate = fftw_malloc;
    static constexpr auto release = fftw_free;
};

/** Memory with the alignment that plans were made for; contents undefined. */
template <class Real> class FftArray {
public:
    explicit FftArray(size_t size = 0) { resize(size); }
    ~FftArray() { FftLibrary<Real>::release(data); }
    FftArray(const FftArray&) = delete;
    FftArray& operator=(const FftArray&) = delete;
    void resize(size_t size);
    Real* begin() { return data; }
    const Real* begin() const { return data; }
    Real& operator[](size_t i) { return data[i]; }
    const Real& operator[](size_t i) const { return data[i]; }

private:
    Real* data = nullptr;
};

/**
 * The transforms of a real grid [x][y][z] in two stages that threads can share: planes (y, z)
 * between real and complex, and columns along x, a few at a time, from the grid into a block [x][z]
 * of the caller and back. Unnormalised; forward has exp(-i k x).
 *
 * Every pass goes from one array to another: in place, plans made by estimate are two to four times
 * slower than those made by measurement, out of place they are not (benchmarks/).
 */
template <class Real> class GridFft {
public:
    using Complex = std::complex<Real>;
    /** Distances between rows [z], planes [y][z] of the grid in reals (even), and block width. */
    struct Layout {
        int size[3];
        size_t rowLength;   ///< from one row to the next, >= 2 (nz/2 + 1)
        size_t planeLength; ///< from one plane to the next
        int blockWidth;     ///< columns in one block
    };
    explicit GridFft(const Layout& layout);
    ~GridFft();
    GridFft(const GridFft&) = delete;
    GridFft& operator=(const GridFft&) = delete;
    /** From real `plane` to complex `waves`; `scratch`, a plane too, is overwritten. */
    void planeForward(Real* plane, Real* scratch, Real* waves) const;
    /** From complex to real in place; `scratch` is overwritten. */
    void planeBackward(Real* plane, Real* scratch) const;
    /** @param column  the grid at (x = 0, y, z) */
    void columnForward(Real* column, Complex* block) const;
    void columnBackward(Complex* block, Real* column) const;

private:
    using Plan = typename FftLibrary<Real>::Plan;
    Plan rowForward, rowBackward, lineForward, lineBackward, forwardColumn, backwardColumn;
    std::array<Plan, 6> all() const {
        return {rowForward, rowBackward, lineForward, lineBackward, forwardColumn, backwardColumn};
    }
};

} // namespace PSE

#endif
