// SPDX-License-Identifier: MIT
#include "KernelPrograms.h"
#include "openmm/OpenMMException.h"
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <random>
#include <sstream>

using namespace OpenMM;

namespace PSE {

namespace {

/** The lines that precede the source, as OpenMM's own contexts write them. */
std::string defineLines(const std::map<std::string, std::string>& defines) {
    std::string lines;
    for (const auto& [name, value] : defines)
        lines += "#define " + name + (value.empty() ? "" : " " + value) + "\n";
    return lines;
}

/** FNV-1a: a hash that is the same on every machine. */
std::string hashOf(const std::string& text) {
    std::uint64_t hash = 14695981039346656037u;
    for (const unsigned char c : text)
        hash = (hash ^ c) * 1099511628211u;
    std::ostringstream digits;
    digits << std::hex << std::setw(16) << std::setfill('0') << hash;
    return digits.str();
}

/**
 * Three lines "key value" (program, precision, box), the defines and the source, separated by empty
 * lines. Several processes may write the same file at once: each writes all of it elsewhere first.
 */
void dump(const std::filesystem::path& folder, const ComputeContext& context,
          const std::string& name, const std::string& source,
          const std::map<std::string, std::string>& defines) {
    const std::string precision = context.getUseDoublePrecision()  ? "double"
                                  : context.getUseMixedPrecision() ? "mixed"
                                                                   : "single";
    const std::string box = context.getBoxIsTriclinic() ? "triclinic" : "rectangular";
    const std::string text = "program " + name + "\nprecision " + precision + "\nbox " + box +
                             "\n\n" + defineLines(defines) + "\n" + source;
    const std::string file = name + "-" + precision + "-" + hashOf(text);
    std::error_code error;
    std::random_device random;
    std::filesystem::create_directories(folder, error);
    const std::filesystem::path draft = folder / (file + "." + std::to_string(random()));
    std::ofstream stream(draft, std::ios::binary);
    stream << text;
    stream.close();
    if (stream)
        std::filesystem::rename(draft, folder / (file + ".txt"), error);
    if (!stream || error)
        throw OpenMMException("The device program " + file + " could not be written to '" +
                              folder.string() + "'; correct or unset OPENMMPSE_KERNEL_DUMP");
}

} // namespace

ComputeProgram compileKernels(ComputeContext& context, const std::string& name,
                              const std::string& source,
                              const std::map<std::string, std::string>& defines,
                              const PlanConstants& constants) {
    std::map<std::string, std::string> compiledIn = defines, used = defines;
    for (size_t i = 0; i < constants.size(); i++) {
        const std::string number = std::to_string(constants[i].second);
        compiledIn[constants[i].first] = number;
        used[constants[i].first] = context.getIsCPU() ? "plan[" + std::to_string(i) + "]" : number;
    }
    const char* folder = std::getenv("OPENMMPSE_KERNEL_DUMP");
    if (folder != nullptr && *folder != '\0')
        dump(folder, context, name, source, compiledIn);
    try {
        return context.compileProgram(source, used);
    } catch (const std::exception& failure) {
        throw OpenMMException("The device program '" + name + "' could not be compiled with\n" +
                              defineLines(used) + failure.what());
    }
}

} // namespace PSE
