# SPDX-License-Identifier: MIT
# One function per kind of target. A wheel shares the folder OpenMM.libs with OpenMM's own, so that
# `import openmm` loads our plugins together with its own.
set(PSE_LIBRARY_DIR OpenMM.libs/lib)
set(PSE_PLUGIN_OUTPUT_DIR ${CMAKE_BINARY_DIR}/plugins)

# Compiler settings of all our code (-O3 comes with the build type Release). Symbols are hidden
# unless exported, and none is GNU_UNIQUE: the plugins hold their own copies of the numerics and
# must not merge them.
function(pse_defaults target)
    set_target_properties(${target} PROPERTIES
        CXX_STANDARD 17 CXX_STANDARD_REQUIRED ON CXX_EXTENSIONS OFF
        CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
        POSITION_INDEPENDENT_CODE ON)
    target_compile_options(${target} PRIVATE
        -fno-math-errno $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
endfunction()

function(pse_warnings target)
    target_compile_options(${target} PRIVATE -Wall -Wextra $<$<BOOL:${PSE_WERROR}>:-Werror>)
endfunction()

# The *.cpp files of the given folders; a new file is noticed by the next build.
function(pse_sources result)
    set(files "")
    foreach(folder IN LISTS ARGN)
        file(GLOB found CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp)
        if(NOT found)
            message(FATAL_ERROR "no C++ source in ${folder}")
        endif()
        list(APPEND files ${found})
    endforeach()
    set(${result} ${files} PARENT_SCOPE)
endfunction()

# pse_static_library(<target> <folder>): code that is linked into the plugins and the tests
function(pse_static_library target folder)
    pse_sources(sources ${folder})
    add_library(${target} STATIC ${sources})
    pse_defaults(${target})
    pse_warnings(${target})
    target_include_directories(${target} PUBLIC ${CMAKE_CURRENT_SOURCE_DIR})
endfunction()

# pse_api_library(<target> <folder>...): the public API, libOpenMMPSE.so, and its headers
function(pse_api_library target)
    pse_sources(sources ${ARGN})
    add_library(${target} SHARED ${sources})
    pse_defaults(${target})
    pse_warnings(${target})
    set_target_properties(${target} PROPERTIES OUTPUT_NAME OpenMMPSE INSTALL_RPATH "$ORIGIN")
    target_compile_definitions(${target} PRIVATE PSE_BUILDING_SHARED_LIBRARY)
    target_include_directories(${target} PUBLIC ${CMAKE_CURRENT_SOURCE_DIR}/openmmapi/include)
    target_link_libraries(${target} PUBLIC OpenMM::OpenMM)
    install(TARGETS ${target} LIBRARY DESTINATION ${PSE_LIBRARY_DIR})
    install(DIRECTORY openmmapi/include/ DESTINATION OpenMM.libs/include
        FILES_MATCHING PATTERN "*.h")
endfunction()

# pse_plugin(<target> <folder> <library>...): the kernels of one platform
# OpenMM loads plugins in the order of their length of name, so ours may precede the platform it
# extends: the run path must lead to OpenMM's plugins as well as to the API library.
function(pse_plugin target folder)
    pse_sources(sources ${folder})
    add_library(${target} SHARED ${sources})
    pse_defaults(${target})
    pse_warnings(${target})
    # OPENMM_EXPORT is empty on Linux, so the linker chooses what is visible, not the compiler
    set(exports ${CMAKE_CURRENT_SOURCE_DIR}/cmake/plugin.map)
    set_target_properties(${target} PROPERTIES
        CXX_VISIBILITY_PRESET default LINK_DEPENDS ${exports}
        LIBRARY_OUTPUT_DIRECTORY ${PSE_PLUGIN_OUTPUT_DIR} INSTALL_RPATH "$ORIGIN:$ORIGIN/..")
    # The API library comes along even if no kernel calls it: it registers the XML proxy.
    target_link_options(${target} PRIVATE -Wl,--version-script=${exports} -Wl,--no-as-needed)
    target_link_libraries(${target} PRIVATE ${ARGN})
    # a component each: the plugin for CUDA is a wheel of its own
    install(TARGETS ${target}
        LIBRARY DESTINATION ${PSE_LIBRARY_DIR}/plugins COMPONENT ${target})
endfunction()

# pse_python_module(<name> <interface>): the SWIG module openmmpse.<name>
function(pse_python_module name interface)
    find_program(SWIG_EXECUTABLE swig HINTS ${CMAKE_CURRENT_SOURCE_DIR}/.venv/bin)
    if(NOT SWIG_EXECUTABLE)
        message(FATAL_ERROR "SWIG was not found; install it with: "
            "${Python_EXECUTABLE} -m pip install 'swig~=4.5.0'")
    endif()
    set(folder ${CMAKE_BINARY_DIR}/python/openmmpse)
    set(wrapper ${folder}/${name}Wrapper.cpp)
    file(MAKE_DIRECTORY ${folder})
    file(GLOB interfaces CONFIGURE_DEPENDS python/*.i)
    file(GLOB_RECURSE headers CONFIGURE_DEPENDS openmmapi/include/*.h)
    # 325, 453 come from OpenMM's own interface file, 314 from a Python keyword in it
    add_custom_command(OUTPUT ${wrapper} ${folder}/${name}.py
        COMMAND ${SWIG_EXECUTABLE} -python -c++ -doxygen -w314,325,453
            -outdir ${folder} -o ${wrapper}
            # Ours first: an installed copy lies beside OpenMM's headers.
            -I${CMAKE_CURRENT_SOURCE_DIR}/openmmapi/include -I${CMAKE_CURRENT_SOURCE_DIR}/python
            -I${OPENMM_DIR}/include ${CMAKE_CURRENT_SOURCE_DIR}/${interface}
        DEPENDS ${interfaces} ${headers} VERBATIM)
    Python_add_library(${name} MODULE WITH_SOABI ${wrapper})
    pse_defaults(${name})
    set_target_properties(${name} PROPERTIES
        OUTPUT_NAME _${name} LIBRARY_OUTPUT_DIRECTORY ${folder}
        INSTALL_RPATH "$ORIGIN/../${PSE_LIBRARY_DIR}")
    target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/python)
    target_link_libraries(${name} PRIVATE PSE)
    install(TARGETS ${name} LIBRARY DESTINATION openmmpse)
    install(FILES ${folder}/${name}.py DESTINATION openmmpse)
endfunction()

# pse_platform_test(<name>): a test per platform and precision, of a binary that takes them as
# arguments. What a machine lacks is "Skipped" there, never passed.
function(pse_platform_test name)
    foreach(run IN ITEMS Reference CPU OpenCL.single OpenCL.mixed OpenCL.double
            CUDA.single CUDA.mixed CUDA.double)
        string(REPLACE "." ";" arguments ${run})
        add_test(NAME ${name}.${run} COMMAND ${name} ${arguments})
        set_tests_properties(${name}.${run} PROPERTIES
            TIMEOUT ${PSE_LONGEST_RUN} SKIP_RETURN_CODE 77 ENVIRONMENT "${PSE_PLUGIN_ENVIRONMENT}")
    endforeach()
endfunction()

# pse_tests(<folder>): one binary per Test*.cpp; each test case is a ctest of its own, but for those
# that run on all platforms
function(pse_tests folder)
    set(apiTests TestCppApi)
    set(platformTests TestPlatforms TestPlatformSteps)
    # escaped: a ":" separates folders for OpenMM, a ";" would separate CMake's list
    set(PSE_PLUGIN_ENVIRONMENT
        "OPENMM_PLUGIN_DIR=${OPENMM_DIR}/lib/plugins:${PSE_PLUGIN_OUTPUT_DIR}")
    set(PSE_LONGEST_CASE 300) # seconds
    set(PSE_LONGEST_RUN 900)
    if(PSE_SANITIZE)
        set(PSE_LONGEST_CASE 1500) # sanitizers are slow
        set(PSE_LONGEST_RUN 3000)
        # neither drivers of devices nor an installed openmmpse without sanitizers
        file(MAKE_DIRECTORY ${PSE_PLUGIN_OUTPUT_DIR})
        file(CREATE_LINK ${OPENMM_DIR}/lib/plugins/libOpenMMCPU.so
            ${PSE_PLUGIN_OUTPUT_DIR}/libOpenMMCPU.so SYMBOLIC)
        set(PSE_PLUGIN_ENVIRONMENT "OPENMM_PLUGIN_DIR=${PSE_PLUGIN_OUTPUT_DIR}")
    endif()
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/Test*.cpp)
    foreach(source IN LISTS sources)
        get_filename_component(name ${source} NAME_WE)
        add_executable(${name} ${source})
        pse_defaults(${name})
        pse_warnings(${name})
        target_link_libraries(${name} PRIVATE psenumerics)
        set(environment "")
        if(name MATCHES "^TestCpu(AllPairs|Engine|Lists|Mixture|Threads)$")
            target_link_libraries(${name} PRIVATE psecpu)
        endif()
        if(name IN_LIST apiTests OR name IN_LIST platformTests)
            target_link_libraries(${name} PRIVATE PSE)
            set(environment ${PSE_PLUGIN_ENVIRONMENT})
            foreach(platform IN ITEMS Reference CPU OpenCL CUDA)
                if(TARGET OpenMMPSE${platform})
                    add_dependencies(${name} OpenMMPSE${platform})
                endif()
            endforeach()
        endif()
        if(name IN_LIST platformTests)
            target_link_libraries(${name} PRIVATE GTest::gtest)
            pse_platform_test(${name})
            continue()
        endif()
        target_link_libraries(${name} PRIVATE GTest::gtest_main)
        gtest_discover_tests(${name} TEST_PREFIX ${name}. DISCOVERY_MODE PRE_TEST
            PROPERTIES TIMEOUT ${PSE_LONGEST_CASE} ENVIRONMENT "${environment}")
    endforeach()
    add_test(NAME layers
        COMMAND ${Python_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/check_layers.py)
endfunction()
