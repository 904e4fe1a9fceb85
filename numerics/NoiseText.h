// SPDX-License-Identifier: MIT
// Counter-based Gaussian noise [T17] as one text in the common subset of C++, CUDA C and OpenCL C
// 1.2: it is compiled into the kernels of the GPU platforms, and DeviceNoise.h compiles it for the
// processor, once for each precision. Hence no guard and no #include here. Whoever includes it has
//     DEVICE    the qualifier of functions
//     real      float, or double where USE_DOUBLE_PRECISION is defined
//     mm_ulong  an unsigned integer of 64 bits
//     RSQRT     1/sqrt(x) in single precision, to a relative error of 1e-5 or better
//     SQRT      in double precision, used there alone
// all of which OpenMM's dialect of kernels has.
//
// No logarithm, sine or cosine of the compiler's is called. In single precision fast-math replaces
// them by approximations; in double precision polynomials for what a word can be take a fraction of
// their time. Each number is as exact as its arithmetic. Nothing here depends on fused, contracted
// or reassociated operations, on denormal numbers, infinities or signed zeros.
//
// Words -> numbers: x = (first + 1/2)/2^32, alpha = pi/2^31 times the signed second word,
// z = sqrt(-2 ln x) (cos alpha, sin alpha), |z| <= sqrt(66 ln 2) = 6.764.
// Error in single precision, for every pair of words: 3.6e-7 |z| at most (3.1e-7 where the compiler
// fuses products and sums), 5.4e-8 |z| rms. In double precision: 5e-16 |z|, 9e-17 |z|
// rms.

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

/* The bits of a number, and the number of which these are the bits. */
#if defined(__OPENCL_VERSION__)
#define BITS_OF(number) as_ulong(number)
#define FROM_BITS(bits) as_double(bits)
#elif defined(__CUDACC__)
#define BITS_OF(number) ((mm_ulong)__double_as_longlong(number))
#define FROM_BITS(bits) __longlong_as_double((long long)(bits))
#else
#define BITS_OF(number) bitsOf(number)
#define FROM_BITS(bits) fromBits(bits)
DEVICE mm_ulong bitsOf(real number) {
    mm_ulong bits;
    __builtin_memcpy(&bits, &number, sizeof(bits));
    return bits;
}
DEVICE real fromBits(mm_ulong bits) {
    real number;
    __builtin_memcpy(&number, &bits, sizeof(number));
    return number;
}
#endif

/**
 * -ln((word + 1/2)/2^32) > 0 to a relative error of 1.6e-16, for every word.
 *
 * word + 1/2 has 33 bits, so it is 2^(32 - e) (1 + f) with f in [-1/3, 1/3) exactly. With
 * s = f/(2 + f) and z = s^2, ln(1 + f) = 2 artanh s = f - s (f - z R(z)): what rounding does to s
 * counts f times. R has degree 6, fitted like Q in single precision to a relative error of
 * ln(1 + f) of 1.7e-17.
 */
DEVICE real minusLogarithm(unsigned int word) {
    const mm_ulong bits = BITS_OF((real)word + 0.5);
    const mm_ulong power = (bits - 0x3FD5555555555555) >> 52; // exponent; these are the bits of 1/3
    const real f = FROM_BITS(bits - ((power - 1) << 52)) - 1;
    const real e = (real)(33 - (int)power);
    const real s = f / (2 + f), z = s * s;
    real r = 0.15367357403771773;
    r = r * z + 0.15250304917788868;
    r = r * z + 0.1818634970795399;
    r = r * z + 0.2222213867267278;
    r = r * z + 0.28571429392962344;
    r = r * z + 0.39999999996176244;
    r = r * z + 0.6666666666667268;
    // ln 2 in two parts, of which the first times e is exact
    return e * 0.6931471805599472 - (f - (s * (f - z * r) - e * 1.8641886737243033e-15));
}

/**
 * Cosine and sine of pi/2^31 times the signed word, each to a relative error of 2e-16, for every
 * word.
 *
 * As in single precision, S and C of degree 6, fitted to relative errors of 3.7e-18 and 3.2e-19.
 * Bits exchange the two and set their signs, because branches would be mispredicted half the time.
 */
DEVICE void cosineAndSine(unsigned int word, real* cosine, real* sine) {
    const unsigned int quarter = (word + 0x20000000u) >> 30;
    const real t = (real)(int)(word - (quarter << 30)) * (1.0 / 536870912.0);
    const real u = t * t;
    real s = 6.876065452894022e-12;
    s = s * u - 1.7571464104952601e-9;
    s = s * u + 3.133616186761503e-7;
    s = s * u - 3.6576204157044376e-5;
    s = s * u + 2.4903945701884385e-3;
    s = s * u - 8.074551218828051e-2;
    s = s * u - 2.146018366025517e-1;
    real c = -3.838748742041269e-13;
    c = c * u + 1.1499839214554221e-10;
    c = c * u - 2.4611354929693177e-8;
    c = c * u + 3.59086043997064e-6;
    c = c * u - 3.259918869247027e-4;
    c = c * u + 1.5854344243815106e-2;
    c = c * u - 3.0842513753404244e-1;
    const mm_ulong ofSine = BITS_OF(t + t * s), ofCosine = BITS_OF(1 + u * c);
    const mm_ulong swap = (ofSine ^ ofCosine) & (0 - (mm_ulong)(quarter & 1));
    *cosine = FROM_BITS(ofCosine ^ swap ^ ((mm_ulong)((quarter + 1) & 2) << 62));
    *sine = FROM_BITS(ofSine ^ swap ^ ((mm_ulong)(quarter & 2) << 62));
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
