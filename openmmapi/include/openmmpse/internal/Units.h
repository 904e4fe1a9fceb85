// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_UNITS_H_
#define OPENMMPSE_UNITS_H_

namespace PSE {

/** kT/T in kJ/(mol K): the molar gas constant, exact in the SI. */
constexpr double KT_PER_KELVIN = 8.31446261815324e-3;
/** One Da/(nm ps) in mPa s. */
constexpr double MPAS_PER_MD_VISCOSITY = 1 / 602.214076;

} // namespace PSE

#endif
