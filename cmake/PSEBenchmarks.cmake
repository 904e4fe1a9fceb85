# SPDX-License-Identifier: MIT
# The programs of benchmarks/, which are not installed; `./run bench` drives them.
find_path(CALLGRIND_INCLUDE_DIR valgrind/callgrind.h)
find_package(benchmark QUIET)
if(NOT CALLGRIND_INCLUDE_DIR OR NOT benchmark_FOUND)
    message(FATAL_ERROR "Google Benchmark or valgrind/callgrind.h was not found; install them "
        "(Debian, Ubuntu: apt-get install libbenchmark-dev valgrind) or set PSE_BUILD_BENCHMARKS=OFF")
endif()
pse_find(PSE::FFTWThreads libfftw3-dev fftw3.h "" fftw3_threads fftw3f_threads)

# pse_benchmark(<target> <source>...): a program that loads the plugins as just built
function(pse_benchmark target)
    list(TRANSFORM ARGN PREPEND benchmarks/)
    add_executable(${target} ${ARGN})
    pse_defaults(${target})
    pse_warnings(${target})
    # OpenMM's plugins first: ours replace those that are installed
    target_compile_definitions(${target} PRIVATE
        PSE_PLUGIN_FOLDERS="${OPENMM_DIR}/lib/plugins:${PSE_PLUGIN_OUTPUT_DIR}")
    target_link_libraries(${target} PRIVATE PSE)
    add_dependencies(${target} OpenMMPSECPU)
endfunction()

pse_benchmark(counted_steps counted_steps.cpp)
target_include_directories(counted_steps SYSTEM PRIVATE ${CALLGRIND_INCLUDE_DIR})
target_link_libraries(counted_steps PRIVATE PSE::FFTW PSE::Highway)

pse_benchmark(bench_stages bench_steps.cpp bench_stages.cpp bench_fft.cpp)
target_link_libraries(bench_stages PRIVATE psecpu benchmark::benchmark PSE::FFTWThreads)
foreach(kind r2c c2r "")
    foreach(precision f "")
        string(JOIN _ planner fftw${precision}_plan_many_dft ${kind})
        target_link_options(bench_stages PRIVATE -Wl,--wrap=${planner})
    endforeach()
endforeach()
