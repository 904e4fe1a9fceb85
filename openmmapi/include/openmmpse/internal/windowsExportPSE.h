// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_WINDOWSEXPORTPSE_H_
#define OPENMMPSE_WINDOWSEXPORTPSE_H_

#if defined(_WIN32)
#ifdef PSE_BUILDING_SHARED_LIBRARY
#define OPENMM_EXPORT_PSE __declspec(dllexport)
#else
#define OPENMM_EXPORT_PSE __declspec(dllimport)
#endif
#else
#define OPENMM_EXPORT_PSE __attribute__((visibility("default")))
#endif

#endif
