// SPDX-License-Identifier: MIT
// Counter-based Gaussian noise [T17] as one text in the common subset of C++, CUDA C and OpenCL C
// 1.2: it is compiled into the kernels of the GPU platforms, and DeviceNoise.h compiles it for the
// processor, once for each precision. Hence no guard and no #include here. Whoever includes it has
//     DEVICE               the qualifier of functions
//     real                 float, or double where USE_DOUBLE_PRECISION is defined
//     mm_ulong             an unsigned integer of 64 bits
//     RSQRT                1/sqrt(x) in single precision, to a relative error of 1e-5 or better
//     LOG, SQRT, COS, SIN  in double precision, used there alone
// all of which OpenMM's dialect of kernels has.
//
// Single precision calls no logarithm, sine or cosine of the compiler's, which fast-math replaces
// by approximations: each number is as exact as its arithmetic. Nothing here depends on fused,
// contracted or reassociated operations, on denormal numbers, infinities or signed zeros.
//
// Words -> numbers: x = (first + 1/2)/2^32, alpha = pi/2^31 times the signed second word,
// z = sqrt(-2 ln x) (cos alpha, sin alpha), |z| <= sqrt(66 ln 2) = 6.764.
// Error in single precision, for every pair of words: 3.6e-7 |z| at most (3.1e-7 where the compiler
// fuses products and sums), 5.4e-8 |z| rms. In double precision: 4e-15.

/**
 * Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC11): ten rounds of a bijection of 128 bits, keyed
 * by 64. words[4]: the counter block, which the random words replace.
 */
DEVICE void philox(unsigned int* words, unsigned int key0, unsigned int key1) {
    for (int round = 0; round < 10; round++) {
        const mm_ulong p0 = (mm_ulong)words[0] * 0xD2511F53u;
        const mm_ulong p1 = (mm_ulong)words[2] * 0xCD9E8D57u;
        words[0] = (unsigned int)(p1 >> 32) ^ words[1] ^ key0;
        words[1] = (unsigned int)p1;
        words[2] = (unsigned int)(p0 >> 32) ^ words[3] ^ key1;
        words[3] = (unsigned int)p0;
        key0 += 0x9E3779B9u;
        key1 += 0xBB67AE85u;
    }
}

/** Of n and -n, the one from which both draw: the first non-zero of (n3, n1, n2) is positive. */
DEVICE bool isCanonicalMode(int n1, int n2, int n3) {
    return n3 > 0 || (n3 == 0 && (n1 > 0 || (n1 == 0 && n2 > 0)));
}

/**
 * The 64-bit index of a mode, the same for n and -n: 21 bits of two's complement for each canonical
 * component.
 */
DEVICE mm_ulong modeIndex(int n1, int n2, int n3) {
    const int sign = isCanonicalMode(n1, n2, n3) ? 1 : -1;
    const mm_ulong p1 = (unsigned int)(sign * n1) & 0x1FFFFFu;
    const mm_ulong p2 = (unsigned int)(sign * n2) & 0x1FFFFFu;
    const mm_ulong p3 = (unsigned int)(sign * n3) & 0x1FFFFFu;
    return p1 | (p2 << 21) | (p3 << 42);
}

/* Leading zeros of a word that is not zero. */
#if defined(__OPENCL_VERSION__)
#define LEADING_ZEROS(word) ((int)clz(word))
#elif defined(__CUDACC__)
#define LEADING_ZEROS(word) __clz((int)(word))
#else
#define LEADING_ZEROS(word) __builtin_clz(word)
#endif

#ifdef USE_DOUBLE_PRECISION

/** -ln((word + 1/2)/2^32) > 0. The argument is exact: 33 bits. */
DEVICE real minusLogarithm(unsigned int word) {
    return -LOG(((real)word + (real)0.5) * (real)(1.0 / 4294967296.0));
}

/** Cosine and sine of pi/2^31 times the signed word. */
DEVICE void cosineAndSine(unsigned int word, real* cosine, real* sine) {
    const real angle = (real)(int)word * (real)(3.14159265358979323846 / 2147483648.0);
    *cosine = COS(angle);
    *sine = SIN(angle);
}

DEVICE real positiveRoot(real x) {
    return SQRT(x);
}

#else

/**
 * -ln((word + 1/2)/2^32) > 0 to a relative error of 1.61e-7, for every word.
 *
 * x = (1 + f)/2^e with f in [-1/3, 1/3) from the bits of 2 word + 1. Integers make f, so that near
 * x = 1 it is the complement -(2^32 - word - 1/2)/2^32 with all its digits, where a rounded x has
 * none. ln(1 + f) = f + f^2 Q(f) with Q of degree 7. Each of its coefficients, beginning with the
 * lowest, is the one of the minimax fit with those before it fixed, rounded to single precision;
 * the fit minimises the relative error of the result, f^2 |Q - Q_exact|/(-ln x), to 2.1e-8.
 */
DEVICE real minusLogarithm(unsigned int word) {
    // In the upper half 2 word + 1 has 33 bits; the last is added to the excess, which it matters
    // to where that is f near 0 itself.
    const int upper = (int)(word >> 31);
    const unsigned int odd = upper ? word : 2 * word + 1;
    const int zeros = LEADING_ZEROS(odd);
    const unsigned int mantissa = odd << zeros; // in [2^31, 2^32)
    const int above = mantissa >= 0xAAAAAAABu;  // 2/3
    // f 2^32, modulo 2^32: mantissa - 2^32, or 2 mantissa - 2^32
    const int excess = (int)(above ? mantissa : mantissa << 1);
    const real f = ((real)excess + (upper ? 0.5f : 0.0f)) * (1.0f / 4294967296.0f);
    const real e = (real)(zeros + 2 - upper - above);
    real q = 0.149862155f;
    q = q * f - 0.153394341f;
    q = q * f + 0.137635127f;
    q = q * f - 0.164303347f;
    q = q * f + 0.200289831f;
    q = q * f - 0.250064999f;
    q = q * f + 0.333327740f;
    q = q * f - 0.499999732f;
    // ln 2 in two parts, of which the first times e is exact
    return e * 0.693145751953125f - (f + (f * f * q - e * 1.42860682e-6f));
}

/**
 * Cosine and sine of pi/2^31 times the signed word, each to a relative error of 1.41e-7, for every
 * word.
 *
 * Integers split the angle into a whole number of quarter turns and t pi/4 with t in [-1, 1), so
 * that zeros of both are exact. sin(t pi/4) = t + t S(t^2) and cos(t pi/4) = 1 + t^2 C(t^2), both
 * polynomials of degree 3, fitted like the logarithm's to relative errors of 1.1e-8 and 5e-10.
 */
DEVICE void cosineAndSine(unsigned int word, real* cosine, real* sine) {
    const unsigned int quarter = (word + 0x20000000u) >> 30;
    const real t = (real)(int)(word - (quarter << 30)) * (1.0f / 536870912.0f);
    const real u = t * t;
    const real s = t + t * (((-3.57369609e-5f * u + 2.48969370e-3f) * u - 8.07453245e-2f) * u -
                            2.14601845e-1f);
    const real c =
        1.0f +
        (((3.49403695e-6f * u - 3.25868663e-4f) * u + 1.58542842e-2f) * u - 3.08425128e-1f) * u;
    const real first = (quarter & 1) ? s : c, second = (quarter & 1) ? c : s;
    *cosine = ((quarter + 1) & 2) ? -first : first;
    *sine = (quarter & 2) ? -second : second;
}

/** sqrt(x), x > 0: one step of Newton's, after which the error of RSQRT does not matter. */
DEVICE real positiveRoot(real x) {
    const real inverse = RSQRT(x), root = x * inverse;
    return root + 0.5f * inverse * (x - root * root);
}

#endif

/** Two normal numbers of the given variance from two random words (Box-Muller). */
DEVICE void normalPair(unsigned int first, unsigned int second, real variance, real* z0, real* z1) {
    const real radius = positiveRoot(2 * variance * minusLogarithm(first));
    real cosine, sine;
    cosineAndSine(second, &cosine, &sine);
    *z0 = radius * cosine;
    *z1 = radius * sine;
}

/** Two standard normal numbers from two random words. */
DEVICE void boxMuller(unsigned int first, unsigned int second, real* z0, real* z1) {
    normalPair(first, second, (real)1, z0, z1);
}

/**
 * Random words for an index of 64 bits: part 0 and part 1 have four each. The index takes 64 bits
 * of the counter block, the counter 48 and the part 16; the stream is half of the key.
 */
DEVICE void indexWords(unsigned int seed, unsigned int stream, unsigned int counterLow,
                       unsigned int counterHigh, mm_ulong index, unsigned int part,
                       unsigned int* words) {
    words[0] = (unsigned int)index;
    words[1] = (unsigned int)(index >> 32);
    words[2] = counterLow;
    words[3] = (counterHigh & 0xFFFFu) | (part << 16);
    philox(words, seed, stream);
}

/** Three standard normal numbers z[3] of a particle, from its random words. */
DEVICE void particleNormals(const unsigned int* words, real* z) {
    real unused;
    boxMuller(words[0], words[1], &z[0], &z[1]);
    boxMuller(words[2], words[3], &z[2], &unused);
}

/**
 * Three standard normal numbers z[3] for a particle, by its index in the System. The counter has 48
 * bits.
 */
DEVICE void particleNoise(unsigned int seed, unsigned int stream, unsigned int counterLow,
                          unsigned int counterHigh, unsigned int particle, real* z) {
    unsigned int words[4];
    indexWords(seed, stream, counterLow, counterHigh, particle, 0, words);
    particleNormals(words, z);
}

/**
 * Three complex normal numbers re[3] + i im[3] for a mode n, real and imaginary part of variance
 * 1/2 each; for -n the complex conjugate of those for n, exactly.
 */
DEVICE void modeNoise(unsigned int seed, unsigned int stream, unsigned int counterLow,
                      unsigned int counterHigh, int n1, int n2, int n3, real* re, real* im) {
    const mm_ulong index = modeIndex(n1, n2, n3);
    unsigned int words[4];
    indexWords(seed, stream, counterLow, counterHigh, index, 0, words);
    normalPair(words[0], words[1], (real)0.5, &re[0], &im[0]);
    normalPair(words[2], words[3], (real)0.5, &re[1], &im[1]);
    indexWords(seed, stream, counterLow, counterHigh, index, 1, words);
    normalPair(words[0], words[1], (real)0.5, &re[2], &im[2]);
    if (!isCanonicalMode(n1, n2, n3))
        for (int c = 0; c < 3; c++)
            im[c] = -im[c];
}
