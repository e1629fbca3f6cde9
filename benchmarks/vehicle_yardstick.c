/* A real vehicle's closed loop by hand, for speed: the flights of `airframes.CALM`; with NOISE those of `FULL`.
 *
 * The same loop as `Scored(Loop(Multirotor, Orbit(), RotationBackstepping(), MovingAir(), Suite(delay=2)))`: four rotors in an
 * X that lag, with drag, flapping, lift and gyroscopic torques; gyro and attitude loop every tick, fixes that are two periods
 * late, and the position loop with them; two ten-neuron nets; RK4; steady wind, a swing and a gust. As in `yardstick.c` every
 * number may differ from flight to flight, but for the nets' input weights and the rotors' places.
 *
 * By hand: sums over the rotors use that their arms are alike and their axes parallel; what follows from a fix is computed
 * with the fix, a part of the attitude net too; the rotors' lag, linear, costs two products a stage; turns are polynomials
 * without roots; what flights rarely need (a rotor at its limit, a projection, a large turn) is a branch for the whole block.
 */
#ifndef NOISE
#define NOISE 0
#endif
#include "vehicle_law.h"
#include "vehicle_noise.h"

/* What moves besides the position and the rotors: velocity, body rates, attitude. */
#define MOVING 10

/* Their rates. w: of the rotors [rad/s]; spin_up: of their angular momentum, over J_r. */
INLINE void derivative(V *rate, const Numbers *p, const Constant *k, const V *wind, const V *x, const V *w, V spin_up) {
    const V *velocity = x, *rates = x + 3, *q = x + 6;
    V r[3][3], through[3], air[3], f[3], torque[3], turning[3];
    rotation(r, q);
    for (int i = 0; i < 3; i++) through[i] = velocity[i] - wind[i];
    for (int i = 0; i < 3; i++) air[i] = r[0][i] * through[0] + r[1][i] * through[1] + r[2][i] * through[2];
    V a = ARM * rates[0], b = ARM * rates[1], e = ARM * rates[2];
    /* all rotors; left less right; front less rear; those that turn clockwise less the others */
    V w0 = w[0] + w[1], w1 = w[0] - w[1], w2 = w[2] + w[3], w3 = w[2] - w[3];
    V sum = w0 + w2, left = w0 - w2, front = w1 - w3, clock = w1 + w3;
    V s[4] = {w[0] * w[0], w[1] * w[1], w[2] * w[2], w[3] * w[3]};
    w0 = s[0] + s[1], w1 = s[0] - s[1], w2 = s[2] + s[3], w3 = s[2] - s[3];
    V flow[2] = {air[0] * sum - e * left, air[1] * sum + e * front};
    V lift = (num)4 * (air[0] * air[0] + air[1] * air[1] + (num)2 * (e * e));
    V drag = root(dot(air, air));
    f[0] = -p->hub[0] * flow[0] - p->parasitic[0] * (drag * air[0]);
    f[1] = -p->hub[1] * flow[1] - p->parasitic[1] * (drag * air[1]);
    f[2] = p->thrust * (w0 + w2) + p->lift * lift - p->hub[2] * (air[2] * sum + a * left - b * front);
    f[2] -= p->parasitic[2] * (drag * air[2]);
    V lever = (num)8 * (p->lift * e);
    torque[0] = ARM * (p->thrust * (w0 - w2) - lever * air[0] - p->hub[2] * (air[2] * left + a * sum - b * clock));
    torque[1] = ARM * (p->hub[2] * (air[2] * front + a * clock - b * sum) - p->thrust * (w1 - w3) - lever * air[1]);
    torque[2] = ARM * (p->hub[0] * (air[0] * left - e * sum) - p->hub[1] * (air[1] * front + e * sum));
    torque[0] += p->flapping * flow[1];
    torque[1] -= p->flapping * flow[0];
    torque[2] += p->torque * (w1 + w3) + p->spinning * spin_up;
    V momentum[3], crossed[3];
    for (int i = 0; i < 3; i++) momentum[i] = p->inertia[i] * rates[i];
    momentum[2] -= p->spinning * clock;
    cross(crossed, rates, momentum);
    for (int i = 0; i < 3; i++) rate[3 + i] = (torque[i] - crossed[i]) * k->per_inertia[i], f[i] *= k->per_mass;
    for (int i = 0; i < 3; i++) rate[i] = dot(r[i], f);
    rate[2] -= p->gravity;
    for (int i = 0; i < 3; i++) turning[i] = (num)0.5 * rates[i];
    rate[6] = -dot(q + 1, turning);
    rate[7] = q[0] * turning[0] + q[2] * turning[2] - q[3] * turning[1];
    rate[8] = q[0] * turning[1] - q[1] * turning[2] + q[3] * turning[0];
    rate[9] = q[0] * turning[2] + q[1] * turning[1] - q[2] * turning[0];
}

/* RK4. A rotor's gap to its command falls by the same factors in every step; the position follows from the accelerations. */
INLINE void advance(Cycle *c, const Numbers *p, const Constant *k, const V *blowing, num t, num h) {
    V wind[3], wanted[4], gap[4], pull[4], factor[4][4], w[4];
    V x[MOVING], begin[MOVING], rate[MOVING], first[MOVING], middle[MOVING];
    for (int i = 0; i < 3; i++) wind[i] = blowing[i];
    if (k->swings) {
        V s, cosine;
        turn(p->swing_frequency * (t + (num)0.5 * h), &s, &cosine);
        for (int i = 0; i < 3; i++) wind[i] += s * p->swing[i];
    }
    if (k->gusts) {
        V s, cosine;
        turn((num)6.283185307179586 * clamp((t + (num)0.5 * h - p->gust_start) / p->gust_length, all(0), all(1)), &s, &cosine);
        for (int i = 0; i < 3; i++) wind[i] += (num)0.5 * ((num)1 - cosine) * p->gust[i];
    }
    for (int j = 0; j < 4; j++) {
        wanted[j] = clamp(c->held_speeds[j], p->slowest, p->fastest);
        gap[j] = wanted[j] - c->speeds[j];
        I rising = gap[j] > 0;
        pull[j] = gap[j] * pick(rising, k->pull[0], k->pull[1]);
        for (int i = 0; i < 4; i++) factor[j][i] = pick(rising, k->lag[0][i], k->lag[1][i]);
        w[j] = c->speeds[j];
    }
    memcpy(begin, c->velocity, sizeof c->velocity), memcpy(begin + 3, c->rates, sizeof c->rates);
    memcpy(begin + 6, c->attitude, sizeof c->attitude), memcpy(x, begin, sizeof x);
#pragma GCC unroll 4
    for (int stage = 0; stage < 4; stage++) {
        V up[4];
        for (int j = 0; j < 4; j++) up[j] = stage ? pull[j] * factor[j][stage - 1] : pull[j];
        derivative(rate, p, k, wind, x, w, up[0] - up[1] + up[2] - up[3]);
        if (stage == 0) memcpy(first, rate, sizeof first);
        if (stage == 1) memcpy(middle, rate, sizeof middle);
        if (stage == 3) break;
        for (int i = 0; i < MOVING; i++) {
            if (stage == 2) middle[i] += rate[i];
            x[i] = begin[i] + (stage == 2 ? h : (num)0.5 * h) * rate[i];
        }
        for (int j = 0; j < 4; j++) w[j] = wanted[j] - gap[j] * factor[j][stage];
    }
    num sixth = h / 6;
    for (int i = 0; i < MOVING; i++) x[i] = begin[i] + sixth * (first[i] + (num)2 * middle[i] + rate[i]);
    for (int i = 0; i < 3; i++) c->position[i] += h * (begin[i] + sixth * (first[i] + middle[i]));
    memcpy(c->velocity, x, sizeof c->velocity), memcpy(c->rates, x + 3, sizeof c->rates);
    straighten(x + 6);
    memcpy(c->attitude, x + 6, sizeof c->attitude);
    for (int j = 0; j < 4; j++) c->speeds[j] = wanted[j] - gap[j] * factor[j][3];
}

/* Flies `blocks` blocks of WIDTH flights through `last` ticks of h [s]. every: ticks from one run to the next of gyro, fix,
 * position loop, law and score; gyro and law run every tick. */
void fly(int64_t blocks, int64_t last, const int64_t *every, num h, const num *weights1, const num *weights2,
         const Numbers *numbers, Cycle *cycles, Score *scores) {
    every += NOISE; /* with it the first is the turbulence's */
    for (int64_t block = 0; block < blocks; block++) {
        const Numbers *p = numbers + block;
        const Constant k = constant(p, h);
        Cycle c = cycles[block];
        Score score = {0};
        score.ended = all((num)last);
        V up[3], known[N], wind[3];
        memcpy(wind, p->wind, sizeof wind);
        Noise noise;
        if (NOISE) noise = noise_of(p, h, (num)every[-1] * h, (num)every[1] * h);
        int limited = 0;
        for (int64_t tick = 0; tick <= last; tick++) {
            num t = (num)tick * h;
            if (NOISE && tick % every[-1] == 0) stir(wind, &c, p, &noise, tick);
            memcpy(c.gyro, c.rates, sizeof c.gyro);
            if (NOISE) sense(&c, &noise, tick);
            if (tick % every[1] == 0) {
                V r[3][3], speed[3];
                c.fix = c.queued[0], c.queued[0] = c.queued[1];
                memcpy(&c.queued[1], &c, sizeof(Fix)); /* the state begins with these */
                if (NOISE) disturb(&c, p, &noise, tick);
                rotation(r, c.fix.attitude);
                for (int i = 0; i < 3; i++) {
                    up[i] = r[i][2];
                    speed[i] = r[0][i] * c.fix.velocity[0] + r[1][i] * c.fix.velocity[1] + r[2][i] * c.fix.velocity[2];
                    speed[i] *= (num)1 / SPEED;
                }
                for (int j = 0; j < N; j++) {
                    const num *w = weights2 + 10 * j;
                    known[j] = w[9] + w[0] * speed[0] + w[1] * speed[1] + w[2] * speed[2];
                }
            }
            if (tick % every[2] == 0) guide(&c, p, &k, weights1, up, t, (num)every[2] * h, limited);
            int due = tick % every[4] == 0;
            V norm = due ? most(weight_square(c.weights1), weight_square(c.weights2)) : all(0), e1[3];
            position(e1, p, &k, t);
            for (int i = 0; i < 3; i++) e1[i] -= c.position[i];
            follow(&c, p, &k, weights2, known, t, h, limited);
            c.asked_thrust = most(dot(c.force, up), all(0));
            limited = allocate(&c, p, &k);
            /* limits */
            V off2 = dot(e1, e1), spin = most(most(size(c.rates[0]), size(c.rates[1])), size(c.rates[2]));
            V sum = off2 + spin + size(c.asked_thrust);
            for (int i = 0; i < 3; i++) sum += size(c.velocity[i]) + size(c.rates[i]) + size(c.asked_torque[i]);
            for (int i = 0; i < 4; i++) sum += size(c.speeds[i]);
            I fine = (spin < p->spin) & (off2 < k.distance2) & (c.position[2] >= p->ground) & (sum < (num)1e30);
            I failed = ~fine & (score.code == 0);
            if (any(failed)) { /* rare */
                V code = pick(spin < p->spin, all(0), all(4));
                code = pick(off2 < k.distance2, code, all(2));
                code = pick(c.position[2] >= p->ground, code, all(5));
                code = pick(sum < (num)1e30, code, all(1));
                if (!end(&score, failed, code, tick)) break;
            }
            if (due) sample(&score, tick == 0, off2, c.thrust, c.torque, norm);
            if (tick < last) advance(&c, p, &k, wind, t, h);
        }
        cycles[block] = c;
        scores[block] = score;
    }
}

LAYOUT
