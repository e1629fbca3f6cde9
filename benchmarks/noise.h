/* Noise from a counter in every flight of a block: Threefry-2x32 with 20 rounds, Box and Muller; and Dryden turbulence. */
#ifndef NOISE_H
#define NOISE_H
#include "yardstick.h"

typedef uint32_t W __attribute__((vector_size(BYTES / sizeof(num) * 4)));
typedef int32_t H __attribute__((vector_size(BYTES / sizeof(num) * 4)));
#define NUMBERS(words) __builtin_convertvector(words, V)
#define MOST_PAIRS 64 /* of a stream */
#define MOST_AT_ONCE 6

#if DOUBLE
static const num L[] = {0.666666666666667, 0.39999999999899505, 0.28571428625975487, 0.2222221113479508, 0.18182889125261723,
                        0.15331721600556042, 0.14616449685043406};
#else
static const num L[] = {0.6666668503957586f, 0.3998878056602198f, 0.2957994939197279f};
#endif

/* Of a normal number above zero. */
INLINE V logarithm(V x) {
    I bits = (I)x;
    V mantissa = (V)((bits & (((whole)1 << SHIFT) - 1)) | (I)all((num)0.5));
    V count = (V)((bits >> SHIFT) - (BIAS - 1) + (I)all(MAGIC)) - (num)MAGIC;
    I small = mantissa < (num)0.7071067811865476;
    V f = pick(small, mantissa + mantissa, mantissa) - (num)1;
    count = pick(small, count - (num)1, count);
    V s = f / ((num)2 + f), z = s * s, half = (num)0.5 * f * f;
    V tail = count * (num)LN2_LOW + s * (half + z * POLYNOMIAL(z, L));
    return count * (num)LN2_HIGH + (f - (half - tail));
}

typedef struct {
    W word[3];
} Key;

INLINE Key key_of(const V *halves) {
    W w[4];
    for (int i = 0; i < 4; i++) w[i] = (W)__builtin_convertvector(halves[i], H);
    Key key = {{(w[0] << 16) | w[1], (w[2] << 16) | w[3]}};
    key.word[2] = key.word[0] ^ key.word[1] ^ 0x1BD11BDA;
    return key;
}

/* 2 `pairs` normal numbers of a stream at a tick. */
INLINE void normals(V *numbers, const Key *key, int pairs, uint32_t stream, uint32_t tick) {
    static const int rotations[8] = {13, 15, 26, 6, 17, 29, 16, 24};
    W left[MOST_AT_ONCE], right[MOST_AT_ONCE];
    for (int i = 0; i < pairs; i++) {
        left[i] = key->word[0] + tick;
        right[i] = key->word[1] + (stream * MOST_PAIRS + (uint32_t)i);
    }
#pragma GCC unroll 5
    for (int group = 0; group < 5; group++) {
#pragma GCC unroll 4
        for (int j = 0; j < 4; j++) {
            int distance = rotations[(4 * group + j) % 8];
            for (int i = 0; i < pairs; i++) {
                left[i] += right[i];
                right[i] = ((right[i] << distance) | (right[i] >> (32 - distance))) ^ left[i];
            }
        }
        W first = key->word[(group + 1) % 3], second = key->word[(group + 2) % 3] + (uint32_t)(group + 1);
        for (int i = 0; i < pairs; i++) left[i] += first, right[i] += second;
    }
    for (int i = 0; i < pairs; i++) {
        V u = (NUMBERS(left[i]) + (num)0.5) * (num)2.3283064365386963e-10;
        V radius = root((num)-2 * logarithm(u));
        /* the angle's quarters are in its upper two bits, so that it needs no reduction */
        W turned = right[i] + (1u << 29);
        H rest = (H)(turned & 0x3FFFFFFF) - (1 << 29);
        V r = (NUMBERS(rest) + (num)0.5) * (num)1.4629180792671596e-09, z = r * r;
        V s = r + (r * z) * POLYNOMIAL(z, S), c = (num)1 - ((num)0.5 * z - (z * z) * POLYNOMIAL(z, C));
        I quarter = __builtin_convertvector((H)(turned >> 30), I), odd = (quarter & 1) != 0;
        V sine = pick(odd, c, s), cosine = pick(odd, s, c);
        numbers[2 * i] = radius * (V)((I)cosine ^ (((quarter + 1) & 2) << SIGN));
        numbers[2 * i + 1] = radius * (V)((I)sine ^ ((quarter & 2) << SIGN));
    }
}

/* A step of (z1, z2): z1 = decay z1 + l[0] n1, z2 = decay (h z1 + z2) + l[1] n1 + l[2] n2. */
typedef struct {
    V h, decay, l[3];
} Step;

INLINE Step step_of(V h, V sigma) {
    V x = h + h, decay = exponential(-x), rest = all(1);
    for (int k = 11; k > 3; k--) rest = (num)1 + rest * x * ((num)1 / (num)k);
    V series = decay * (x * x * x * ((num)1 / 6)) * rest, closed = (num)1 - decay * ((num)1 + x + (num)0.5 * x * x);
    V third = pick(x < (num)0.25, series, closed), second = third + decay * ((num)0.5 * x * x), first = second + decay * x;
    Step step = {h, exponential(-h), {root((num)0.5 * first)}};
    step.l[1] = (num)0.25 * second / pick(h > 0, step.l[0], all(1));
    V square = (num)0.25 * third - step.l[1] * step.l[1];
    step.l[2] = root(pick(square > 0, square, all(0)));
    for (int i = 0; i < 3; i++) step.l[i] *= sigma;
    return step;
}

INLINE void take(V *z, const Step *step, V first, V second) {
    V before = z[0];
    z[0] = step->decay * before + step->l[0] * first;
    z[1] = step->decay * (step->h * before + z[1]) + (step->l[1] * first + step->l[2] * second);
}

#endif
