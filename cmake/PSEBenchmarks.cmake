# SPDX-License-Identifier: MIT
# The programs of benchmarks/, which are not installed; `./run bench` drives them.
find_path(CALLGRIND_INCLUDE_DIR valgrind/callgrind.h)
find_package(benchmark QUIET)
if(NOT CALLGRIND_INCLUDE_DIR OR NOT benchmark_FOUND)
    message(FATAL_ERROR "Google Benchmark or valgrind/callgrind.h was not found; install them "
        "(Debian, Ubuntu: apt-get install libbenchmark-dev valgrind) or set PSE_BUILD_BENCHMARKS=OFF")
endif()

# pse_benchmark(<target> <library>...): one program from benchmarks/<target>.cpp
function(pse_benchmark target)
    add_executable(${target} benchmarks/${target}.cpp)
    pse_defaults(${target})
    pse_warnings(${target})
    target_include_directories(${target} SYSTEM PRIVATE ${CALLGRIND_INCLUDE_DIR})
    # OpenMM's plugins first: ours, as just built, replace installed ones
    target_compile_definitions(${target} PRIVATE
        PSE_PLUGIN_FOLDERS="${OPENMM_DIR}/lib/plugins:${PSE_PLUGIN_OUTPUT_DIR}")
    target_link_libraries(${target} PRIVATE PSE ${ARGN})
    add_dependencies(${target} OpenMMPSECPU OpenMMPSEReference)
endfunction()

pse_benchmark(counted_steps PSE::FFTW PSE::Highway)
