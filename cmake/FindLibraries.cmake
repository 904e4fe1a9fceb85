# SPDX-License-Identifier: MIT
# Imported targets for everything that is not ours. Headers of others are SYSTEM: our warnings are
# for our code.

# OpenMM from its wheel, which has headers and libraries but neither a CMake nor a pkg-config file:
# ask the (possibly isolated) build interpreter where it is.
if(NOT OPENMM_DIR)
    execute_process(
        COMMAND ${Python_EXECUTABLE} -c "import importlib.util as u, pathlib
spec = u.find_spec('openmm')
print(pathlib.Path(spec.origin).parents[1] / 'OpenMM.libs' if spec else '')"
        OUTPUT_VARIABLE OPENMM_DIR OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
if(NOT EXISTS "${OPENMM_DIR}/include/OpenMM.h")
    message(FATAL_ERROR
        "OpenMM 8.6 was not found for ${Python_EXECUTABLE} (looked in '${OPENMM_DIR}'); install it "
        "with: ${Python_EXECUTABLE} -m pip install 'openmm>=8.6.1,<8.7', or set OPENMM_DIR to its "
        "OpenMM.libs folder")
endif()
message(STATUS "OpenMM: ${OPENMM_DIR}")

add_library(OpenMM::OpenMM SHARED IMPORTED)
set_target_properties(OpenMM::OpenMM PROPERTIES
    IMPORTED_LOCATION ${OPENMM_DIR}/lib/libOpenMM.so
    INTERFACE_INCLUDE_DIRECTORIES ${OPENMM_DIR}/include)

# The reference platform lives in libOpenMM itself; its headers include each other without a folder.
add_library(OpenMM::Reference INTERFACE IMPORTED)
set_target_properties(OpenMM::Reference PROPERTIES
    INTERFACE_LINK_LIBRARIES OpenMM::OpenMM
    INTERFACE_INCLUDE_DIRECTORIES ${OPENMM_DIR}/include/openmm/reference)

add_library(OpenMM::CPU SHARED IMPORTED)
set_target_properties(OpenMM::CPU PROPERTIES
    IMPORTED_LOCATION ${OPENMM_DIR}/lib/plugins/libOpenMMCPU.so
    INTERFACE_LINK_LIBRARIES OpenMM::Reference
    INTERFACE_INCLUDE_DIRECTORIES ${OPENMM_DIR}/include/openmm/cpu)

# pse_find(<target> <Debian package> <header> <suffix of its folder> <library>...): headers and
# libraries of a system package
function(pse_find target package header suffix)
    string(MAKE_C_IDENTIFIER "${target}" id)
    find_path(${id}_INCLUDE_DIR ${header} PATH_SUFFIXES ${suffix})
    set(missing "")
    if(NOT ${id}_INCLUDE_DIR)
        list(APPEND missing "the header ${header}")
    endif()
    set(libraries "")
    foreach(name IN LISTS ARGN)
        find_library(${id}_${name}_LIBRARY ${name})
        if(${id}_${name}_LIBRARY)
            list(APPEND libraries ${${id}_${name}_LIBRARY})
        else()
            list(APPEND missing "the library lib${name}")
        endif()
    endforeach()
    if(missing)
        string(REPLACE ";" " and " missing "${missing}")
        message(FATAL_ERROR
            "${missing} was not found; install ${package} (all that openmmpse needs, on Debian and "
            "Ubuntu: apt-get install libfftw3-dev libhwy-dev libeigen3-dev), or add its place to "
            "CMAKE_PREFIX_PATH")
    endif()
    add_library(${target} INTERFACE IMPORTED)
    set_target_properties(${target} PROPERTIES
        INTERFACE_INCLUDE_DIRECTORIES "${${id}_INCLUDE_DIR}"
        INTERFACE_LINK_LIBRARIES "${libraries}")
endfunction()

pse_find(PSE::Eigen libeigen3-dev Eigen/Dense eigen3)
pse_find(PSE::FFTW libfftw3-dev fftw3.h "" fftw3 fftw3f)
pse_find(PSE::Highway libhwy-dev hwy/highway.h "" hwy)
