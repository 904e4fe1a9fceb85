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
            "Ubuntu: apt-get install libfftw3-dev libhwy-dev libeigen3-dev opencl-headers), or add its place to "
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

# OpenMM::OpenCL. Nothing of ours calls OpenCL itself; what OpenMM's headers call is in the library
# that OpenMM's platform brings along when it is loaded, and need not be here.
function(pse_find_opencl)
    pse_find(PSE::OpenCLHeaders opencl-headers CL/cl.h "")
    add_library(OpenMM::OpenCL SHARED IMPORTED GLOBAL)
    set_target_properties(OpenMM::OpenCL PROPERTIES
        IMPORTED_LOCATION ${OPENMM_DIR}/lib/plugins/libOpenMMOpenCL.so
        INTERFACE_LINK_LIBRARIES "OpenMM::OpenMM;PSE::OpenCLHeaders"
        INTERFACE_LINK_OPTIONS -Wl,--allow-shlib-undefined
        INTERFACE_COMPILE_DEFINITIONS CL_TARGET_OPENCL_VERSION=300
        INTERFACE_INCLUDE_DIRECTORIES ${OPENMM_DIR}/include/openmm/opencl)
endfunction()

# OpenMM::CUDA. OpenMM's headers for CUDA are in its main wheel, but need cuda.h, from a toolkit or
# from the wheel nvidia-cuda-runtime. The library is in another wheel (openmm-cuda-13), which asks for
# much that a build does not need: without it, an empty library of the same name stands in, as a
# plugin may leave the symbols of its platform to be found when it is loaded.
function(pse_find_cuda)
    execute_process(
        COMMAND ${Python_EXECUTABLE} -c "import importlib.util as u
spec = u.find_spec('nvidia')
print(';'.join(f'{p}/cu13' for p in spec.submodule_search_locations) if spec else '')"
        OUTPUT_VARIABLE wheels OUTPUT_STRIP_TRAILING_WHITESPACE)
    find_path(PSE_CUDA_INCLUDE_DIR cuda.h PATH_SUFFIXES include
        HINTS ENV CUDA_PATH ENV CUDA_HOME ${wheels} PATHS /usr/local/cuda)
    if(NOT PSE_CUDA_INCLUDE_DIR)
        message(FATAL_ERROR "The header cuda.h was not found; install a CUDA toolkit (and set "
            "CUDA_PATH if it is not in /usr/local/cuda), or: "
            "${Python_EXECUTABLE} -m pip install 'nvidia-cuda-runtime>=13,<14'")
    endif()
    set(library ${OPENMM_DIR}/lib/plugins/libOpenMMCUDA.so)
    if(EXISTS ${library})
        add_library(OpenMM::CUDA SHARED IMPORTED GLOBAL)
        set_target_properties(OpenMM::CUDA PROPERTIES
            IMPORTED_LOCATION ${library}
            INTERFACE_LINK_OPTIONS "-Wl,--allow-shlib-undefined;-Wl,--no-undefined")
    else()
        message(STATUS "OpenMM's CUDA platform is not installed: linking without checking its symbols")
        file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/cuda/empty.cpp CONTENT "")
        add_library(OpenMMCUDA SHARED ${CMAKE_BINARY_DIR}/cuda/empty.cpp)
        set_target_properties(OpenMMCUDA PROPERTIES
            LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/cuda)
        add_library(OpenMM::CUDA ALIAS OpenMMCUDA)
    endif()
    get_target_property(target OpenMM::CUDA ALIASED_TARGET)
    if(NOT target)
        set(target OpenMM::CUDA)
    endif()
    target_include_directories(${target} SYSTEM INTERFACE
        ${OPENMM_DIR}/include/openmm/cuda ${PSE_CUDA_INCLUDE_DIR})
    target_link_libraries(${target} INTERFACE OpenMM::OpenMM)
endfunction()
