// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUSPREAD_H_
#define OPENMMPSE_CPUSPREAD_H_

#include "Threads.h"
#include "numerics/Lattice.h"
#include "numerics/Vec3.h"
#include <algorithm>
#include <array>
#include <vector>

namespace PSE {

/**
 * From particles to the grid and back: forces onto one plane after another, velocities by the
 * transpose. Which grid points a particle touches, and how much, is for the derived class to say.
 *
 * Particles are kept in the order of the columns (x, y) of the first grid point that each touches.
 */
template <class Real> class CpuSpread {
public:
    /** @param padding  points by which rows of the grid are longer than the grid */
    CpuSpread(const std::array<int, 3>& grid, int padding) : padded(padding) {
        std::copy(grid.begin(), grid.end(), size);
    }
    virtual ~CpuSpread() = default;
    int padding() const { return padded; }
    /** Reals from one row of the grid to the next, and from one plane to the next. */
    void setLayout(size_t row, size_t plane) {
        rowLength = row;
        planeLength = plane;
    }
    /** Another box, of a Plan made for one that moves. */
    virtual void setBox(const numerics::Lattice&) {}
    // The parts of placeParticles():
    virtual void begin(int particles);
    virtual void assign(const std::vector<numerics::Vec3>& fractions, int from, int to) = 0;
    void sort();
    virtual void place(const std::vector<numerics::Vec3>& fractions, int from, int to) = 0;
    /** The forces on the particles at places [from, to), over a unit. */
    void takeForces(const std::vector<numerics::Vec3>& forces, double unit, int from, int to);
    /** How many planes spreadPlanes() does at most, and best. */
    virtual int planesTogether() const { return 1; }
    /** Set `number` planes [y][z] of three grids to the forces from x on; row ends are folded back.
     */
    virtual void spreadPlanes(int x, int number, Real* const planes[3]) const = 0;
    /**
     * u += unit times the velocities at the particles of places [from, to), from three grids whose
     * row ends repeat their beginnings. The forces are lost.
     */
    void addGathered(const Real* const grids[3], double unit, int from, int to,
                     std::vector<numerics::Vec3>& u);
    int places() const { return static_cast<int>(order.size()); }

protected:
    /** sorted[place][3] of places [from, to). */
    virtual void gather(const Real* const grids[3], int from, int to) = 0;
    void setColumn(int particle, int x, int y) { columnOf[particle] = x * size[1] + y; }
    int columnX(int particle) const { return columnOf[particle] / size[1]; }
    int columnY(int particle) const { return columnOf[particle] % size[1]; }

    int size[3], padded;
    size_t rowLength = 0, planeLength = 0;
    std::vector<int> order, columnStart;
    std::vector<int> first;   ///< [place][3] first grid point touched, in [0, M_d)
    std::vector<Real> sorted; ///< [place][3] forces, later velocities

private:
    std::vector<int> columnOf; ///< of each particle
};

} // namespace PSE

#endif
