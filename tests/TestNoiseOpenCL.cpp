// SPDX-License-Identifier: MIT
// NoiseText.h compiled as OpenCL C, with the definitions and options of OpenMM's OpenCL platform,
// on every OpenCL device of this machine, against long double. The library is loaded at run time:
// where there is none, nor a device, these tests are skipped.

#include "NoiseOracle.h"
#include <gtest/gtest.h>

#if __has_include(<CL/cl.h>)

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>

namespace {

void* library() {
    static void* const handle = dlopen("libOpenCL.so.1", RTLD_NOW);
    return handle;
}

#define OPENCL(function) reinterpret_cast<decltype(&::function)>(dlsym(library(), #function))

void check(cl_int status, const std::string& what) {
    if (status != CL_SUCCESS)
        throw std::runtime_error(what + ": OpenCL error " + std::to_string(status));
}

std::vector<cl_device_id> devices() {
    std::vector<cl_device_id> all;
    cl_platform_id platforms[8];
    cl_uint count = 0;
    if (library() == NULL || OPENCL(clGetPlatformIDs)(8, platforms, &count) != CL_SUCCESS)
        return all;
    for (cl_uint i = 0; i < std::min(count, 8u); i++) {
        cl_device_id found[8];
        cl_uint n = 0;
        if (OPENCL(clGetDeviceIDs)(platforms[i], CL_DEVICE_TYPE_ALL, 8, found, &n) == CL_SUCCESS)
            all.insert(all.end(), found, found + std::min(n, 8u));
    }
    return all;
}

bool hasDouble(cl_device_id device) {
    cl_device_fp_config config = 0;
    return OPENCL(clGetDeviceInfo)(device, CL_DEVICE_DOUBLE_FP_CONFIG, sizeof config, &config,
                                   NULL) == CL_SUCCESS &&
           config != 0;
}

std::string noiseText() {
    const auto root = std::filesystem::path(__FILE__).parent_path().parent_path();
    std::ifstream file(root / "numerics" / "NoiseText.h");
    std::stringstream text;
    text << file.rdbuf();
    if (text.str().empty())
        throw std::runtime_error("numerics/NoiseText.h was not found in " + root.string());
    return text.str();
}

const char* const DIALECT = R"(
#define DEVICE
typedef ulong mm_ulong;
#define SQRT sqrt
#define RSQRT rsqrt
)";

const char* const KERNELS = R"(
__kernel void pairs(__global const uint* restrict words, __global real* restrict z) {
    const size_t i = get_global_id(0);
    real z0, z1;
    boxMuller(words[2*i], words[2*i+1], &z0, &z1);
    z[2*i] = z0;
    z[2*i+1] = z1;
}
__kernel void particles(__global const uint* restrict words, __global real* restrict z) {
    const size_t i = get_global_id(0);
    real own[3];
    particleNoise(words[5*i], words[5*i+1], words[5*i+2], words[5*i+3], words[5*i+4], own);
    for (int c = 0; c < 3; c++)
        z[3*i+c] = own[c];
}
__kernel void modes(__global const uint* restrict words, __global real* restrict z) {
    const size_t i = get_global_id(0);
    real re[3], im[3];
    modeNoise(7, 1, 12345, 6, (int) words[3*i], (int) words[3*i+1], (int) words[3*i+2], re, im);
    for (int c = 0; c < 3; c++) {
        z[6*i+c] = re[c];
        z[6*i+3+c] = im[c];
    }
}
)";

/** The text on one device in one precision. */
template <class Real> class Program {
public:
    explicit Program(cl_device_id device) {
        cl_int status;
        context = OPENCL(clCreateContext)(NULL, 1, &device, NULL, NULL, &status);
        check(status, "clCreateContext");
        queue = OPENCL(clCreateCommandQueue)(context, device, 0, &status);
        check(status, "clCreateCommandQueue");
        const std::string precision = sizeof(Real) == 8 ? "#define USE_DOUBLE_PRECISION 1\n"
                                                          "typedef double real;\n"
                                                        : "typedef float real;\n";
        const std::string source = DIALECT + precision + noiseText() + KERNELS;
        const char* text = source.c_str();
        program = OPENCL(clCreateProgramWithSource)(context, 1, &text, NULL, &status);
        check(status, "clCreateProgramWithSource");
        status = OPENCL(clBuildProgram)(program, 1, &device, "-cl-mad-enable -cl-no-signed-zeros",
                                        NULL, NULL);
        std::string log(10000, '\0');
        OPENCL(clGetProgramBuildInfo)
        (program, device, CL_PROGRAM_BUILD_LOG, log.size(), &log[0], NULL);
        check(status, "clBuildProgram: " + log);
    }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;
    ~Program() {
        OPENCL(clReleaseProgram)(program);
        OPENCL(clReleaseCommandQueue)(queue);
        OPENCL(clReleaseContext)(context);
    }

    /** `numbers` normal numbers from each of `items` equal parts of the words. */
    std::vector<Real> run(const char* name, std::vector<uint32_t> words, size_t items,
                          size_t numbers) const {
        std::vector<Real> z(items * numbers);
        cl_int status;
        cl_mem in = OPENCL(clCreateBuffer)(context, CL_MEM_COPY_HOST_PTR, 4 * words.size(),
                                           words.data(), &status);
        check(status, "clCreateBuffer");
        cl_mem out = OPENCL(clCreateBuffer)(context, CL_MEM_READ_WRITE, sizeof(Real) * z.size(),
                                            NULL, &status);
        check(status, "clCreateBuffer");
        cl_kernel kernel = OPENCL(clCreateKernel)(program, name, &status);
        check(status, "clCreateKernel");
        check(OPENCL(clSetKernelArg)(kernel, 0, sizeof in, &in), "clSetKernelArg");
        check(OPENCL(clSetKernelArg)(kernel, 1, sizeof out, &out), "clSetKernelArg");
        check(OPENCL(clEnqueueNDRangeKernel)(queue, kernel, 1, NULL, &items, NULL, 0, NULL, NULL),
              "clEnqueueNDRangeKernel");
        check(OPENCL(clEnqueueReadBuffer)(queue, out, CL_TRUE, 0, sizeof(Real) * z.size(), z.data(),
                                          0, NULL, NULL),
              "clEnqueueReadBuffer");
        OPENCL(clReleaseKernel)(kernel);
        OPENCL(clReleaseMemObject)(in);
        OPENCL(clReleaseMemObject)(out);
        return z;
    }

private:
    cl_context context;
    cl_command_queue queue;
    cl_program program;
};

/** Compares with what NoiseText.h states. */
class Comparison {
public:
    void add(long double computed, long double exact) { errors.add(computed, exact, exact); }
    template <class Real> void expect(const char* what) const {
        EXPECT_LT(errors.largest, noiseOracle::NUMBER_ERROR<Real>) << what;
        EXPECT_GT(errors.count, 0u) << what;
    }

private:
    noiseOracle::Errors errors;
};

template <class Real> void checkPairs(const Program<Real>& program) {
    std::vector<uint32_t> words;
    std::mt19937 random(8);
    for (uint32_t word : noiseOracle::hardWords(8191, 256)) {
        words.insert(words.end(), {word, uint32_t(random())});
        words.insert(words.end(), {uint32_t(random()), word});
    }
    ASSERT_GT(words.size(), 2000000u);
    const std::vector<Real> z = program.run("pairs", words, words.size() / 2, 2);
    Comparison comparison;
    for (size_t i = 0; i < words.size(); i += 2) {
        const auto exact = noiseOracle::normalPair(words[i], words[i + 1], 1);
        comparison.add(z[i], exact[0]);
        comparison.add(z[i + 1], exact[1]);
    }
    comparison.expect<Real>("pairs");
}

template <class Real> void checkParticles(const Program<Real>& program) {
    const size_t count = 5000;
    std::vector<uint32_t> words(5 * count);
    std::generate(words.begin(), words.end(), std::mt19937(9));
    const std::vector<Real> z = program.run("particles", words, count, 3);
    Comparison comparison;
    for (size_t i = 0; i < count; i++) {
        const uint32_t* w = &words[5 * i];
        const uint64_t counter = w[2] + (uint64_t(w[3]) << 32);
        const auto exact = noiseOracle::particleNoise(w[0], w[1], counter, w[4]);
        for (int c = 0; c < 3; c++)
            comparison.add(z[3 * i + c], exact[c]);
    }
    comparison.expect<Real>("particles");
}

template <class Real> void checkModes(const Program<Real>& program) {
    std::vector<int> modes;
    for (int scale : {1, 1000, 262143})
        for (int n1 = -4; n1 <= 4; n1++)
            for (int n2 = -4; n2 <= 4; n2++)
                for (int n3 = -4; n3 <= 4; n3++)
                    if (n1 != 0 || n2 != 0 || n3 != 0)
                        modes.insert(modes.end(), {scale * n1, scale * n2, scale * n3});
    const size_t count = modes.size() / 3;
    const std::vector<Real> z =
        program.run("modes", std::vector<uint32_t>(modes.begin(), modes.end()), count, 6);
    Comparison comparison;
    for (size_t i = 0; i < count; i++) {
        const int* n = &modes[3 * i];
        const auto exact =
            noiseOracle::modeNoise(7, 1, 12345 + (uint64_t(6) << 32), n[0], n[1], n[2]);
        for (int c = 0; c < 6; c++)
            comparison.add(z[6 * i + c], exact[c]);
    }
    comparison.expect<Real>("modes");
}

template <class Real> void checkAll(cl_device_id device) {
    const Program<Real> program(device);
    checkPairs(program);
    checkParticles(program);
    checkModes(program);
}

} // namespace

TEST(NoiseOpenCL, SinglePrecisionIsThatOfTheText) {
    if (devices().empty())
        GTEST_SKIP() << "no OpenCL device; install one (Debian, Ubuntu: pocl-opencl-icd)";
    for (cl_device_id device : devices())
        checkAll<float>(device);
}

TEST(NoiseOpenCL, DoublePrecisionIsThatOfTheText) {
    int checked = 0;
    for (cl_device_id device : devices())
        if (hasDouble(device)) {
            checkAll<double>(device);
            checked++;
        }
    if (checked == 0)
        GTEST_SKIP() << "no OpenCL device of double precision; install one (Debian, Ubuntu: "
                        "pocl-opencl-icd)";
}

#else

TEST(NoiseOpenCL, IsNotTested) {
    GTEST_SKIP() << "compiled without CL/cl.h; install it (Debian, Ubuntu: opencl-headers)";
}

#endif
