/* What the C of the benchmarks shares: one number in every flight of a block, the laws' elementary functions, their nets. */
#ifndef YARDSTICK_H
#define YARDSTICK_H
#include <stdint.h>
#include <string.h>
#ifdef __AVX512DQ__
#include <immintrin.h>
#endif

#if DOUBLE
typedef double num;
typedef int64_t whole;
#else
typedef float num;
typedef int32_t whole;
#endif
#ifndef BYTES
#ifdef __AVX512F__
#define BYTES 64
#else
#define BYTES 32
#endif
#endif
typedef num V __attribute__((vector_size(BYTES)));
typedef whole I __attribute__((vector_size(BYTES)));
#define WIDTH ((int)(BYTES / sizeof(num)))
#define N 10
#define INLINE static inline __attribute__((always_inline))

INLINE V all(num x) { return x - (V){0}; }

#if defined __AVX512DQ__ && BYTES == 64 /* what the compiler makes several instructions of */
#if DOUBLE
#define MASK(m) _mm512_movepi64_mask((__m512i)(m))
INLINE V pick(I m, V a, V b) { return (V)_mm512_mask_blend_pd(MASK(m), (__m512d)b, (__m512d)a); }
INLINE V least(V a, V b) { return (V)_mm512_min_pd((__m512d)a, (__m512d)b); }
INLINE V most(V a, V b) { return (V)_mm512_max_pd((__m512d)a, (__m512d)b); }
#else
#define MASK(m) _mm512_movepi32_mask((__m512i)(m))
INLINE V pick(I m, V a, V b) { return (V)_mm512_mask_blend_ps(MASK(m), (__m512)b, (__m512)a); }
INLINE V least(V a, V b) { return (V)_mm512_min_ps((__m512)a, (__m512)b); }
INLINE V most(V a, V b) { return (V)_mm512_max_ps((__m512)a, (__m512)b); }
#endif
INLINE int any(I m) { return MASK(m) != 0; }
#else
INLINE V pick(I m, V a, V b) { return (V)((m & (I)a) | (~m & (I)b)); }
INLINE V least(V a, V b) { return pick(a < b, a, b); }
INLINE V most(V a, V b) { return pick(a > b, a, b); }
INLINE int any(I m) {
    whole r = 0;
    for (int i = 0; i < WIDTH; i++) r |= m[i];
    return r != 0;
}
#endif
INLINE V root(V x) {
    V r;
    for (int i = 0; i < WIDTH; i++) r[i] = sizeof(num) == 8 ? __builtin_sqrt(x[i]) : __builtin_sqrtf(x[i]);
    return r;
}
INLINE V size(V x) { return (V)((I)x & ~(I)all(-(num)0.0)); }
INLINE V clamp(V x, V low, V high) { return least(most(x, low), high); }

#if DOUBLE
static const num S[] = {-0.16666666666666666, 0.0083333333333307, -0.00019841269836387345, 2.755731591191116e-06,
                        -2.5051092507061385e-08, 1.59153232122714e-10};
static const num C[] = {0.041666666666666664, -0.0013888888888887241, 2.4801587298533456e-05, -2.755731715246704e-07,
                        2.087612165887116e-09, -1.1380876948169717e-11};
static const num E[] = {0.5, 0.1666666666666667, 0.04166666666666667, 0.008333333333325544, 0.0013888888888883327,
                        0.00019841269876864356, 2.4801587327007187e-05, 2.755725283351691e-06, 2.75572718102198e-07,
                        2.5106274733573296e-08, 2.0915442297780116e-09};
static const num A[] = {-0.3333333333333333, 0.19999999999999785, -0.14285714285654638, 0.11111111104652255,
                        -0.09090908728587459, 0.07692295658327873, -0.06666412077725274, 0.058787824694439814,
                        -0.0522938047378184, 0.045467195095551666, -0.034445844423577385, 0.016148228546771868};
#define HALF_PI1 1.5707963267341256
#define HALF_PI2 6.077100506303966e-11
#define HALF_PI3 2.0222662487959506e-21
#define LN2_HIGH 0.6931471805599454
#define LN2_LOW -8.783192846883203e-17
static const num P[] = {0.6931471805599462, 0.24022650695910075, 0.05550410866465167, 0.009618129107618665,
                        0.0013333558200794592, 0.00015403530424776529, 1.5252672924850737e-05, 1.3215451633221434e-06,
                        1.0205905413765595e-07, 7.070977866508138e-09};
#define MAGIC 6755399441055744.0
#define LOW -708.0
#define HIGH 709.0
#define BIAS 1023
#define SHIFT 52
#define SIGN 62
#else
static const num S[] = {-0.16666664539989612f, 0.008332724732630293f, -0.0001958285585078999f};
static const num C[] = {0.04166666453694609f, -0.0013888279449649538f, 2.454289633694463e-05f};
static const num E[] = {0.5f, 0.16666573381900845f, 0.04166655011030512f, 0.008363773874405574f, 0.0013926926614021907f};
static const num A[] = {-0.33333331686451945f, 0.1999952339722771f, -0.1426336657972561f, 0.1073739696716272f,
                        -0.06431038710715442f};
#define HALF_PI1 1.5703125f
#define HALF_PI2 0.00048351287841796875f
#define HALF_PI3 3.1385570764541626e-07f
#define LN2_HIGH 0.693115234375f
#define LN2_LOW 3.1946184945309414e-05f
static const num P[] = {0.6931471805599453f, 0.2402234903802036f, 0.05550381013796457f, 0.009666368515385448f,
                        0.0013381302537320797f};
#define MAGIC 12582912.0f
#define LOW -87.0f
#define HIGH 88.0f
#define BIAS 127
#define SHIFT 23
#define SIGN 30
#endif

INLINE V horner(V x, const num *c, int count) {
    V r = all(c[count - 1]);
    for (int i = count - 2; i >= 0; i--) r = r * x + c[i];
    return r;
}
#define POLYNOMIAL(x, c) horner(x, c, sizeof(c) / sizeof(num))

INLINE void turn(V x, V *sine, V *cosine) {
    V moved = x * (num)0.6366197723675814 + (num)MAGIC;
    V k = moved - (num)MAGIC;
    I quarter = (I)moved;
    V r = x - k * (num)HALF_PI1;
    r = r - k * (num)HALF_PI2;
    r = r - k * (num)HALF_PI3;
    V z = r * r;
    V s = r + (r * z) * POLYNOMIAL(z, S);
    V c = (num)1 - ((num)0.5 * z - (z * z) * POLYNOMIAL(z, C));
    I odd = (quarter & 1) != 0;
    *sine = (V)((I)pick(odd, c, s) ^ ((quarter & 2) << SIGN));
    *cosine = (V)((I)pick(odd, s, c) ^ (((quarter + 1) & 2) << SIGN));
}

INLINE V exponential(V x) {
    x = most(least(x, all(HIGH)), all(LOW));
    V moved = x * (num)1.4426950408889634 + (num)MAGIC;
    V k = moved - (num)MAGIC;
    V r = x - k * (num)LN2_HIGH;
    r = r - k * (num)LN2_LOW;
    V p = (num)1 + (r + (r * r) * POLYNOMIAL(r, E));
    return p * (V)(((I)moved + BIAS) << SHIFT);
}

/* Of a point with y >= 0, x >= 0. */
INLINE V first_quarter(V rise, V run) {
    I steep = rise > run;
    V small = pick(steep, run, rise), large = pick(steep, rise, run);
    I eighth = small > large * (num)0.41421356237309503;
    V over = pick(eighth, small - large, small), under = pick(eighth, small + large, large);
    V r = over / pick(under <= 0, all(1), under);
    V z = r * r;
    V a = r + r * (z * POLYNOMIAL(z, A));
    a = pick(eighth, a + (num)0.7853981633974483, a);
    return pick(steep, (num)1.5707963267948966 - a, a);
}

INLINE V angle(V y, V x) {
    V a = first_quarter(size(y), size(x));
    a = pick(x < 0, (num)3.141592653589793 - a, a);
    return pick(y < 0, -a, a);
}

INLINE V sigmoid(V x) {
    V octaves = most(least(x * (num)-1.4426950408889634, all(BIAS + 1)), all(-BIAS));
    V moved = octaves + (num)MAGIC;
    V r = octaves - (moved - (num)MAGIC);
    return (num)1 / ((num)1 + ((num)1 + r * POLYNOMIAL(r, P)) * (V)(((I)moved + BIAS) << SHIFT));
}

INLINE void net(V *mu, const num *weights, const V *chi, int inputs) {
    for (int j = 0; j < N; j++) {
        const num *w = weights + j * (inputs + 1);
        V s = w[inputs] + w[0] * chi[0], t = w[1] * chi[1];
        for (int i = 2; i < inputs; i += 2) s += w[i] * chi[i];
        for (int i = 3; i < inputs; i += 2) t += w[i] * chi[i];
        mu[j] = sigmoid(s + t);
    }
}

INLINE void output(V *y, V w[N][3], const V *mu) {
    for (int i = 0; i < 3; i++) {
        V s = w[0][i] * mu[0], t = w[1][i] * mu[1];
        for (int j = 2; j < N; j += 2) s += w[j][i] * mu[j], t += w[j + 1][i] * mu[j + 1];
        y[i] = s + t;
    }
}

INLINE void learn(V w[N][3], const V *mu, const V *r, V gain, V keep) {
    for (int j = 0; j < N; j++) {
        V scaled = gain * mu[j];
        for (int i = 0; i < 3; i++) w[j][i] = keep * w[j][i] + scaled * r[i];
    }
}

INLINE V weight_square(V w[N][3]) {
    V s[3] = {{0}};
    for (int j = 0; j < N; j++)
        for (int i = 0; i < 3; i++) s[i] += w[j][i] * w[j][i];
    return s[0] + s[1] + s[2];
}

/* What is left of a flight. */
typedef struct {
    V square, largest, effort, variation, norm, count, code, ended, thrust, torque[3];
} Score;

INLINE V dot(const V *a, const V *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Ends flights here; whether any is left. code: why. */
INLINE int end(Score *score, I failed, V code, int64_t tick) {
    score->code = pick(failed, code, score->code);
    score->ended = pick(failed, all((num)tick), score->ended);
    return any(score->code == 0);
}

/* A sample of the flights that are left. off2: the square of the distance from the path. norm: of the weights, squared. */
INLINE void sample(Score *score, int first, V off2, V thrust, const V *torque, V norm) {
    I alive = score->code == 0;
    V inputs[4] = {thrust, torque[0], torque[1], torque[2]};
    V *held[4] = {&score->thrust, score->torque, score->torque + 1, score->torque + 2};
    score->count += (V)(alive & (I)all(1));
    score->square += (V)(alive & (I)off2);
    score->largest = most((V)(alive & (I)off2), score->largest);
    for (int i = 0; i < 4; i++) {
        score->effort += (V)(alive & (I)(inputs[i] * inputs[i]));
        if (!first) score->variation += (V)(alive & (I)size(inputs[i] - *held[i]));
        *held[i] = inputs[i];
    }
    score->norm = most((V)(alive & (I)norm), score->norm);
}

/* What the caller has to know: how many flights a block has, how many numbers of a flight each structure. */
#define LAYOUT \
    int64_t width(void) { return WIDTH; } \
    int64_t numbers_of(void) { return sizeof(Numbers) / sizeof(V); } \
    int64_t cycle_of(void) { return sizeof(Cycle) / sizeof(V); } \
    int64_t score_of(void) { return sizeof(Score) / sizeof(V); }

#endif
