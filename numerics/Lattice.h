// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_LATTICE_H_
#define OPENMMPSE_NUMERICS_LATTICE_H_

#include "numerics/Vec3.h"
#include <array>
#include <vector>

namespace PSE::numerics {

/**
 * The periodic box: three vectors in the reduced form that OpenMM uses, a = (ax, 0, 0),
 * b = (bx, by, 0), c = (cx, cy, cz), with |bx| <= ax/2, |cx| <= ax/2, |cy| <= by/2. Lengths in nm.
 */
class Lattice {
public:
    /**
     * @throws std::invalid_argument if a vector is not finite, the diagonal not positive, or an
     * upper entry not zero
     */
    Lattice(const Vec3& a, const Vec3& b, const Vec3& c);
    static Lattice orthorhombic(double x, double y, double z);

    /** Box vectors as columns. */
    const Matrix3& vectors() const { return boxVectors; }
    double volume() const { return boxVectors(0, 0) * boxVectors(1, 1) * boxVectors(2, 2); }
    /** Length of box vector d (not the distance between opposite faces). */
    double length(int d) const { return boxVectors.col(d).norm(); }
    /** Distance between the two faces that box vector d connects; at most its length. */
    double width(int d) const { return 1 / inverse.row(d).norm(); }
    /**
     * Smallest diagonal entry: no lattice vector is shorter, and minimumImage() is exact below half
     * of it.
     */
    double smallestWidth() const;
    /** Coordinates in units of the box vectors, not wrapped. */
    Vec3 fractional(const Vec3& x) const { return inverse * x; }
    Vec3 cartesian(const Vec3& s) const { return boxVectors * s; }
    /** Fractional coordinates of the image of x in the primary box, in [0, 1). */
    Vec3 wrappedFractional(const Vec3& x) const;
    /** The image of x in the primary box. */
    Vec3 wrapped(const Vec3& x) const { return cartesian(wrappedFractional(x)); }
    /** The shortest image of a difference vector, exact if shorter than smallestWidth()/2. */
    Vec3 minimumImage(Vec3 d) const;
    /** 2 pi times the reciprocal vectors, as columns: k = waveVectors()*n with integer n. */
    Matrix3 waveVectors() const { return 2 * M_PI * inverse.transpose(); }
    /**
     * All lattice vectors R for which some |d + R| <= range can occur with d between two points of
     * the primary box.
     */
    std::vector<Vec3> imagesWithin(double range) const;
    /** How many lattice vectors imagesWithin() looks at; may exceed any integer. */
    double imageCandidates(double range) const;
    /**
     * The box after a shear strain, x += strain y, in reduced form: the same lattice of images,
     * whichever of its vectors tell of it [T35]. An edge in y has its tilt in [-ax/2, ax/2].
     */
    Lattice sheared(double strain) const;
    /**
     * How many a sheared() takes from b and from c, which the flow alone would have tilted
     * further: its b is b + strain b_y e_x - flips[0] a.
     */
    std::array<int, 2> flips(double strain) const;
    /**
     * The box after x -> map x, in reduced form: the same lattice of images [T47].
     * @param map  upper triangular, with a positive diagonal
     */
    Lattice deformed(const Matrix3& map) const;
    /** The box of the longest vectors that sheared() can return for any strain. */
    Lattice mostSheared() const;
    Lattice scaled(double factor) const;
    bool operator==(const Lattice& other) const { return boxVectors == other.boxVectors; }
    bool operator!=(const Lattice& other) const { return !(*this == other); }

private:
    Matrix3 boxVectors, inverse;
};

} // namespace PSE::numerics

#endif
