/* The paper's closed loop by hand: what a careful programmer gets out of the machine without quadstep.
 *
 * The same loop as `Scored(Loop(MinimumJerk(), Backstepping()))`: two ten-neuron nets, command filter, RK4 on the Lagrange
 * plant, limits checked at every sample, metrics summed every few ticks. Laid out by hand for speed: a block of flights is
 * one struct of vectors, sine and cosine share their reduction, J and C are written out entry by entry, what is constant over
 * a flight is computed once, norms are compared squared, a dead block stops.
 *
 * cc -O3 -march=native -fno-math-errno -fno-trapping-math -DDOUBLE=0 -shared -fPIC yardstick.c
 * These two flags let a square root be one instruction. -ffast-math is not used: the sums are in a good order already, it
 * takes the magic number out of `turn`, and it lets the compiler forget NaN.
 */
#include <stdint.h>
#include <string.h>

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
INLINE V pick(I m, V a, V b) { return (V)((m & (I)a) | (~m & (I)b)); }
INLINE V least(V a, V b) { return pick(a < b, a, b); }
INLINE V most(V a, V b) { return pick(a > b, a, b); }
INLINE V root(V x) {
    V r;
    for (int i = 0; i < WIDTH; i++) r[i] = sizeof(num) == 8 ? __builtin_sqrt(x[i]) : __builtin_sqrtf(x[i]);
    return r;
}
INLINE V size(V x) { return (V)((I)x & ~(I)all(-(num)0.0)); }

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

INLINE V angle(V y, V x) {
    V rise = size(y), run = size(x);
    I steep = rise > run;
    V small = pick(steep, run, rise), large = pick(steep, rise, run);
    I eighth = small > large * (num)0.41421356237309503;
    V over = pick(eighth, small - large, small), under = pick(eighth, small + large, large);
    V r = over / pick(under <= 0, all(1), under);
    V z = r * r;
    V a = r + r * (z * POLYNOMIAL(z, A));
    a = pick(eighth, a + (num)0.7853981633974483, a);
    a = pick(steep, (num)1.5707963267948966 - a, a);
    a = pick(x < 0, (num)3.141592653589793 - a, a);
    return pick(y < 0, -a, a);
}

/* The numbers of a flight, in the order of `flatten`. */
typedef struct {
    V mass, inertia[3], gravity, arm, moment, minimum, maximum;
    V scale, force[3], torque[3];
    V start[3], end[3], yaw_start, yaw_end, duration;
    V m, g, slope1[3], gain1[3], integral1[3], slope2[3], gain2[3], integral2[3], frequency;
    V rate1, damping1, rate2, damping2, learning_start;
    V distance, spin, pitch;
} Numbers;

typedef struct {
    V position[3], velocity[3], attitude[3], rates[3];
    V integral1[3], integral2[3], filtered[2], filtered_rate[2];
    V weights1[N][3], weights2[N][3];
    V thrust, torque[3];
} Cycle;

/* What is left of a flight. */
typedef struct {
    V square, largest, effort, variation, norm, count, code, ended, thrust, torque[3];
} Score;

typedef struct {
    V velocity[3], acceleration[3], rates[3], turning[3];
} Rate;

INLINE Rate derivative(const Numbers *p, V per_mass, const V *v, const V *eta, const V *rates, V u, const V *tau) {
    Rate d;
    V st, ct, sp, cp;
    turn(eta[1], &st, &ct);
    turn(eta[2], &sp, &cp);
    V sd = rates[0], td = rates[1], pd = rates[2];
    V ax = p->scale * (v[0] * pd), ay = p->scale * (v[1] * td), az = p->scale * (v[2] * sd);
    V um = u * per_mass, ctum = ct * um;
    d.acceleration[0] = (ax + p->force[0]) * per_mass - um * st;
    d.acceleration[1] = (ay + p->force[1]) * per_mass + ctum * sp;
    d.acceleration[2] = (az + p->force[2]) * per_mass + (ctum * cp - p->gravity);
    V ix = p->inertia[0], iy = p->inertia[1], iz = p->inertia[2], dyz = iy - iz;
    V sp2 = sp * sp, cp2 = cp * cp, ct2 = ct * ct, spcp = sp * cp, stct = st * ct;
    /* order (phi, theta, psi) */
    V j13 = -ix * st, j22 = iy * cp2 + iz * sp2, j23 = dyz * spcp * ct;
    V mixed = iy * sp2 + iz * cp2, j33 = ix * st * st + mixed * ct2;
    V q = ix - mixed, ds = dyz * sd, turned = td * spcp + sd * (sp2 - cp2) * ct, ixsct = ix * sd * ct;
    V c12 = dyz * turned - ixsct, c13 = -ds * spcp * ct2, c22 = -dyz * pd * spcp, c23 = -q * sd * stct;
    V c31 = -c13 - ix * td * ct, c32 = -dyz * (td * spcp * st + pd * (sp2 - cp2) * ct) - c23, c33 = -c22 * ct2 + q * td * stct;
    V b1 = (tau[2] + p->torque[2] + az) - (c12 * td + c13 * sd);
    V b2 = (tau[1] + p->torque[1] + ay) - (c22 * td + c23 * sd - c12 * pd);
    V b3 = (tau[0] + p->torque[0] + ax) - (c31 * pd + c32 * td + c33 * sd);
    V a11 = j22 * j33 - j23 * j23, a13 = -j22 * j13, a12 = j13 * j23, a22 = ix * j33 - j13 * j13, a23 = -ix * j23, a33 = ix * j22;
    V per_det = (num)1 / (ix * a11 + j13 * a13);
    d.turning[0] = (a13 * b1 + a23 * b2 + a33 * b3) * per_det;
    d.turning[1] = (a12 * b1 + a22 * b2 + a23 * b3) * per_det;
    d.turning[2] = (a11 * b1 + a12 * b2 + a13 * b3) * per_det;
    for (int i = 0; i < 3; i++) d.velocity[i] = v[i], d.rates[i] = rates[i];
    return d;
}

/* RK4: the position follows from the velocities, so only the other nine states are taken along. */
INLINE void advance(Cycle *c, const Numbers *p, V per_mass, num h) {
    Rate sum, k;
    V v[3], eta[3], rates[3];
    memcpy(v, c->velocity, sizeof v), memcpy(eta, c->attitude, sizeof eta), memcpy(rates, c->rates, sizeof rates);
    for (int stage = 0; stage < 4; stage++) {
        k = derivative(p, per_mass, v, eta, rates, c->thrust, c->torque);
        num ahead = stage == 2 ? h : (num)0.5 * h, weight = stage == 1 || stage == 2 ? 2 : 1;
        for (int i = 0; i < 3; i++) {
            sum.velocity[i] = stage ? sum.velocity[i] + weight * k.velocity[i] : k.velocity[i];
            sum.acceleration[i] = stage ? sum.acceleration[i] + weight * k.acceleration[i] : k.acceleration[i];
            sum.rates[i] = stage ? sum.rates[i] + weight * k.rates[i] : k.rates[i];
            sum.turning[i] = stage ? sum.turning[i] + weight * k.turning[i] : k.turning[i];
            v[i] = c->velocity[i] + ahead * k.acceleration[i];
            eta[i] = c->attitude[i] + ahead * k.rates[i];
            rates[i] = c->rates[i] + ahead * k.turning[i];
        }
    }
    num sixth = h / 6;
    for (int i = 0; i < 3; i++) {
        c->position[i] += sixth * sum.velocity[i];
        c->velocity[i] += sixth * sum.acceleration[i];
        c->attitude[i] += sixth * sum.rates[i];
        c->rates[i] += sixth * sum.turning[i];
    }
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

/* Flies `blocks` blocks of WIDTH flights through `last` ticks of `step`, a sample every tick, a score every `every` ticks. */
void fly(int64_t blocks, int64_t last, int64_t every, num h, const num *weights1, const num *weights2, const Numbers *numbers,
         Cycle *cycles, Score *scores) {
    for (int64_t block = 0; block < blocks; block++) {
        const Numbers *p = numbers + block;
        Cycle c = cycles[block];
        Score score = {0};
        score.ended = all((num)last);
        V per_mass = (num)1 / p->mass, per_duration = (num)1 / p->duration, per_duration2 = per_duration * per_duration;
        V wh = p->frequency * h, decay = exponential(-wh), ax1[3], way[3], turn_way = p->yaw_end - p->yaw_start;
        V distance2 = p->distance * p->distance, gain1 = p->rate1 * h, gain2 = p->rate2 * h;
        V loss1 = p->damping1 * gain1, loss2 = p->damping2 * gain2;
        for (int i = 0; i < 3; i++) ax1[i] = p->slope1[i] * p->slope1[i], way[i] = p->end[i] - p->start[i];
        for (int64_t tick = 0; tick <= last; tick++) {
            num t = (num)tick * h;
            V s = most(least(t * per_duration, all(1)), all(0)), rest = (num)1 - s;
            V share = s * s * s * ((num)10 + s * ((num)-15 + (num)6 * s));
            V pace = (num)30 * s * s * rest * rest * per_duration;
            V change = (num)60 * s * rest * ((num)1 - (num)2 * s) * per_duration2;
            V on = (V)((t >= p->learning_start) & (I)all(1));
            V e1[3], r1[3], e2[3], r2[3], mu[N], y[3], f[3], chi[12], tau[3];
            V yaw = p->yaw_start + share * turn_way, yaw_rate = pace * turn_way;
            for (int i = 0; i < 3; i++) {
                e1[i] = p->start[i] + share * way[i] - c.position[i];
                r1[i] = pace * way[i] - c.velocity[i] + p->slope1[i] * e1[i];
                chi[i] = c.position[i], chi[3 + i] = r1[i], chi[6 + i] = c.attitude[i], chi[9 + i] = c.rates[i];
            }
            e2[0] = yaw - c.attitude[0], e2[1] = c.filtered[0] - c.attitude[1], e2[2] = c.filtered[1] - c.attitude[2];
            r2[0] = yaw_rate - c.rates[0] + p->slope2[0] * e2[0];
            r2[1] = c.filtered_rate[0] - c.rates[1] + p->slope2[1] * e2[1];
            r2[2] = c.filtered_rate[1] - c.rates[2] + p->slope2[2] * e2[2];
            V error = root(r1[0] * r1[0] + r1[1] * r1[1] + r1[2] * r1[2] + r2[0] * r2[0] + r2[1] * r2[1] + r2[2] * r2[2]);
            net(mu, weights1, chi, 12);
            output(y, c.weights1, mu);
            learn(c.weights1, mu, r1, on * gain1, (num)1 - on * loss1 * error);
            for (int i = 0; i < 3; i++)
                f[i] = p->m * (change * way[i] - ax1[i] * e1[i]) + on * y[i] + (p->gain1[i] * r1[i] + p->integral1[i] * c.integral1[i]);
            f[2] += p->m * p->g;
            V b2 = f[1] * f[1] + f[2] * f[2], b = root(b2), u = root(f[0] * f[0] + b2);
            V tilt[2] = {angle(-f[0], b), angle(f[1], f[2])};
            for (int i = 0; i < 3; i++) chi[i] = c.attitude[i], chi[3 + i] = r1[i], chi[6 + i] = r2[i];
            net(mu, weights2, chi, 9);
            output(y, c.weights2, mu);
            learn(c.weights2, mu, r2, on * gain2, (num)1 - on * loss2 * error);
            for (int i = 0; i < 3; i++) tau[i] = on * y[i] + (p->gain2[i] * r2[i] + p->integral2[i] * c.integral2[i]);
            /* limits */
            V off2 = e1[0] * e1[0] + e1[1] * e1[1] + e1[2] * e1[2];
            V spin = most(most(size(c.rates[0]), size(c.rates[1])), size(c.rates[2]));
            V sum = off2 + size(c.velocity[0]) + size(c.velocity[1]) + size(c.velocity[2]) + spin + size(c.attitude[0]);
            sum += size(c.attitude[2]) + u + size(tau[0]) + size(tau[1]) + size(tau[2]);
            I fine = (size(c.attitude[1]) < p->pitch) & (spin < p->spin) & (off2 < distance2) & (sum < (num)1e30);
            I failed = ~fine & (score.code == 0);
            int any = 0, flying = 0;
            for (int i = 0; i < WIDTH; i++) any |= failed[i] != 0;
            if (any) { /* rare */
                V code = pick(size(c.attitude[1]) < p->pitch, all(0), all(3));
                code = pick(spin < p->spin, code, all(4));
                code = pick(off2 < distance2, code, all(2));
                code = pick(sum < (num)1e30, code, all(1));
                score.code = pick(failed, code, score.code);
                score.ended = pick(failed, all((num)tick), score.ended);
                for (int i = 0; i < WIDTH; i++) flying |= score.code[i] == 0;
                if (!flying) break;
            }
            for (int i = 0; i < 3; i++) {
                c.integral1[i] += h * r1[i];
                c.integral2[i] += h * r2[i];
            }
            for (int i = 0; i < 2; i++) {
                V offset = c.filtered[i] - tilt[i], slope = c.filtered_rate[i] + p->frequency * offset;
                c.filtered[i] = tilt[i] + decay * (offset + h * slope);
                c.filtered_rate[i] = decay * (c.filtered_rate[i] - wh * slope);
            }
            c.thrust = u;
            for (int i = 0; i < 3; i++) c.torque[i] = tau[i];
            if (tick % every == 0) {
                I alive = score.code == 0;
                V one = (V)(alive & (I)all(1));
                score.count += one;
                score.square += (V)(alive & (I)off2);
                score.largest = most((V)(alive & (I)off2), score.largest);
                V inputs[4] = {u, tau[0], tau[1], tau[2]}, *held[4] = {&score.thrust, score.torque, score.torque + 1, score.torque + 2};
                for (int i = 0; i < 4; i++) {
                    score.effort += (V)(alive & (I)(inputs[i] * inputs[i]));
                    if (tick) score.variation += (V)(alive & (I)size(inputs[i] - *held[i]));
                    *held[i] = inputs[i];
                }
                V norm = most(weight_square(c.weights1), weight_square(c.weights2));
                score.norm = most((V)(alive & (I)norm), score.norm);
            }
            if (tick < last) advance(&c, p, per_mass, h);
        }
        cycles[block] = c;
        scores[block] = score;
    }
}

int64_t width(void) { return WIDTH; }
