// SPDX-License-Identifier: MIT
// What the SWIG wrapper needs beside the wrapped class: vectors as buffers, structures as dicts,
// errors, threads.
#ifndef OPENMMPSE_BINDINGSUPPORT_H_
#define OPENMMPSE_BINDINGSUPPORT_H_

#include <Python.h>

#include "openmmpse/PSEBrownianIntegrator.h"
#include "openmm/Integrator.h"
#include "openmm/OpenMMException.h"
#include "openmm/System.h"
#include "openmm/Vec3.h"
#include "openmm/internal/ContextImpl.h"
#include <cstdint>
#include <cstring>
#include <exception>
#include <map>
#include <vector>

namespace PSE::binding {

/** Lets other Python threads run while it lives. */
class WithoutGil {
public:
    WithoutGil() : state(PyEval_SaveThread()) {}
    ~WithoutGil() { PyEval_RestoreThread(state); }
    WithoutGil(const WithoutGil&) = delete;
    WithoutGil& operator=(const WithoutGil&) = delete;

private:
    PyThreadState* state;
};

/** Copies a C-contiguous buffer of float64 triples; throws if it is something else. */
inline std::vector<OpenMM::Vec3> toVectors(PyObject* object) {
    Py_buffer view;
    if (PyObject_GetBuffer(object, &view, PyBUF_CONTIG_RO) != 0) {
        PyErr_Clear();
        throw OpenMM::OpenMMException("expected a C-contiguous array of float64");
    }
    std::vector<OpenMM::Vec3> values(view.len / sizeof(OpenMM::Vec3));
    if (!values.empty())
        std::memcpy(values.data(), view.buf, values.size() * sizeof(OpenMM::Vec3));
    PyBuffer_Release(&view);
    return values;
}
static_assert(sizeof(OpenMM::Vec3) == 3 * sizeof(double), "a Vec3 must be three doubles");

/** New reference to the bytes of the vectors, for numpy.frombuffer. */
inline PyObject* toBytes(const std::vector<OpenMM::Vec3>& values) {
    return PyByteArray_FromStringAndSize(reinterpret_cast<const char*>(values.data()),
                                         values.size() * sizeof(OpenMM::Vec3));
}

/** New reference to the dict of a map. */
inline PyObject* toDict(const std::map<int, double>& values) {
    PyObject* dict = PyDict_New();
    for (const auto& [index, value] : values) {
        PyObject* key = PyLong_FromLong(index);
        PyObject* item = PyFloat_FromDouble(value);
        PyDict_SetItem(dict, key, item);
        Py_DECREF(key);
        Py_DECREF(item);
    }
    return dict;
}

/** New reference to a dict: stage -> seconds, in the order of the stages. */
inline PyObject* toDict(const std::vector<StageTime>& times) {
    PyObject* dict = PyDict_New();
    for (const StageTime& time : times) {
        PyObject* seconds = PyFloat_FromDouble(time.seconds);
        PyDict_SetItemString(dict, time.stage.c_str(), seconds);
        Py_DECREF(seconds);
    }
    return dict;
}

/** Reaches the Context of an integrator, which OpenMM keeps to derived classes. */
struct ContextAccess : OpenMM::Integrator {
    static OpenMM::ContextImpl* of(const OpenMM::Integrator& integrator) {
        return integrator.*(&ContextAccess::context);
    }
};

/** Particles of the System that an integrator moves; -1 if it has no Context. */
inline int particleCount(const OpenMM::Integrator& integrator) {
    OpenMM::ContextImpl* context = ContextAccess::of(integrator);
    return context ? context->getSystem().getNumParticles() : -1;
}

/** Where the Context of an integrator is in memory; 0 if it has none. */
inline unsigned long long contextAddress(const OpenMM::Integrator& integrator) {
    OpenMM::ContextImpl* context = ContextAccess::of(integrator);
    return context ? reinterpret_cast<uintptr_t>(&context->getOwner()) : 0;
}

/** New reference to the dict that Python sees for NumericalParameters. */
inline PyObject* toDict(const NumericalParameters& p) {
    return Py_BuildValue(
        "{s:s,s:d,s:d,s:d,s:(iii),s:i,s:d,s:d,s:i,s:d,s:s,s:s,s:i}", "split", p.split.c_str(), "xi",
        p.xi, "realCutoff", p.realCutoff, "prolateBandwidth", p.prolateBandwidth, "gridDimensions",
        p.gridDimensions[0], p.gridDimensions[1], p.gridDimensions[2], "windowSupport",
        p.windowSupport, "windowShape", p.windowShape, "lanczosTolerance", p.lanczosTolerance,
        "lanczosIterations", p.lanczosIterations, "predictedError", p.predictedError, "precision",
        p.precision.c_str(), "instructions", p.instructions.c_str(), "randomSeed", p.randomSeed);
}

/** Called in a catch block, with the GIL held. */
inline void raiseOpenMMException(const std::exception& error) {
    PyObject* openmm = PyImport_ImportModule("openmm");
    PyObject* type = openmm ? PyObject_GetAttrString(openmm, "OpenMMException") : NULL;
    PyErr_SetString(type ? type : PyExc_RuntimeError, error.what());
    Py_XDECREF(type);
    Py_XDECREF(openmm);
}

} // namespace PSE::binding

#endif
