# SPDX-License-Identifier: MIT
# Writes kernel sources as C++ strings:
#   cmake -D OUTPUT=<path without suffix> -P EmbedKernels.cmake <file>...
# makes OUTPUT.h with `struct KernelSources { static const std::string <name>, ...; }` and OUTPUT.cpp
# with the texts; <name> is the name of the file, its first letter in lower case. The texts are only
# ever used between quotes, so that CMake changes nothing in them: neither [ ] nor ; nor \.
cmake_minimum_required(VERSION 3.22)
set(DELIMITER KERNEL)

set(names "")
set(definitions "")
set(i 0)
while(i LESS CMAKE_ARGC AND NOT "${CMAKE_ARGV${i}}" STREQUAL "${CMAKE_SCRIPT_MODE_FILE}")
    math(EXPR i "${i} + 1")
endwhile()
math(EXPR i "${i} + 1")
while(i LESS CMAKE_ARGC)
    set(file "${CMAKE_ARGV${i}}")
    math(EXPR i "${i} + 1")
    get_filename_component(name "${file}" NAME_WE)
    string(SUBSTRING "${name}" 0 1 first)
    string(TOLOWER "${first}" first)
    string(SUBSTRING "${name}" 1 -1 rest)
    set(name "${first}${rest}")

    file(READ "${file}" text)
    file(SIZE "${file}" size)
    string(LENGTH "${text}" length) # in bytes
    string(REGEX MATCH "[^\t\n -~]" foreign "${text}")
    string(FIND "${text}" ")${DELIMITER}\"" end)
    if(NOT size EQUAL length OR NOT foreign STREQUAL "" OR NOT end EQUAL -1)
        message(FATAL_ERROR "${file} cannot be a kernel source: it may hold only tabs, newlines and "
            "printable ASCII, and not the text )${DELIMITER}\"")
    endif()
    list(APPEND names "${name}")
    string(APPEND definitions
        "const std::string KernelSources::${name} = R\"${DELIMITER}(${text})${DELIMITER}\";\n")
endwhile()
if(names STREQUAL "")
    message(FATAL_ERROR "EmbedKernels.cmake was given no file")
endif()

string(REPLACE ";" ", " members "${names}")
get_filename_component(header "${OUTPUT}.h" NAME)
file(WRITE "${OUTPUT}.h" "// SPDX-License-Identifier: MIT
#pragma once
#include <string>

namespace PSE {

/** The texts of the device kernels, one per file. */
struct KernelSources {
    static const std::string ${members};
};

} // namespace PSE
")
file(WRITE "${OUTPUT}.cpp" "// SPDX-License-Identifier: MIT
#include \"${header}\"

namespace PSE {

${definitions}
} // namespace PSE
")
