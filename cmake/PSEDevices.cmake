# SPDX-License-Identifier: MIT
# The device platforms: psecommon, written once in OpenMM's Common compute dialect, and one plugin
# per platform that registers it.

# pse_embed_kernels(<target> <file>...): adds KernelSources.h/.cpp, made from the files, to a target
function(pse_embed_kernels target)
    set(output ${CMAKE_BINARY_DIR}/kernels/KernelSources)
    set(script ${CMAKE_CURRENT_SOURCE_DIR}/cmake/EmbedKernels.cmake)
    add_custom_command(OUTPUT ${output}.cpp ${output}.h
        COMMAND ${CMAKE_COMMAND} -D OUTPUT=${output} -P ${script} ${ARGN}
        DEPENDS ${script} ${ARGN}
        COMMENT "Embedding the kernels"
        VERBATIM)
    target_sources(${target} PRIVATE ${output}.cpp ${output}.h)
    target_include_directories(${target} PUBLIC ${CMAKE_BINARY_DIR}/kernels)
endfunction()

pse_static_library(psecommon platforms/common)
target_include_directories(psecommon PUBLIC platforms/common)
target_link_libraries(psecommon PUBLIC psebase)
file(GLOB kernels CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/platforms/common/kernels/*.cc)
pse_embed_kernels(psecommon ${CMAKE_CURRENT_SOURCE_DIR}/numerics/NoiseText.h ${kernels})

if(PSE_BUILD_OPENCL)
    pse_find_opencl()
    pse_plugin(OpenMMPSEOpenCL platforms/opencl psecommon OpenMM::OpenCL)
endif()
if(PSE_BUILD_CUDA)
    pse_find_cuda()
    pse_plugin(OpenMMPSECUDA platforms/cuda psecommon OpenMM::CUDA)
endif()
