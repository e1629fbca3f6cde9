/* The numbers of a real vehicle's flights, and its path. */
#ifndef VEHICLE_H
#define VEHICLE_H
#include "yardstick.h"

#define ARM ((num)0.159099025767075) /* [m] rotors at (+-ARM, +-ARM): front left, rear left, rear right, front right */
/* What the nets' inputs are divided by: m/s, rad/s, rad/s^2, m/s^2. */
#define SPEED 5
#define RATE 5
#define TURN 50
#define GRAVITY 10

/* The numbers of a flight, in the order of `flatten`; some are not read: of the battery, of the accelerometer. */
typedef struct {
    V mass, inertia[3], gravity;
    V thrust, torque, spinning, rise, fall, slowest, fastest, radius;
    V parasitic[3], hub[3], flapping, lift, battery[5], ground;
    V shares[4][4], least, most, per_square;
    V wind[3], swing[3], swing_frequency, gust[3], gust_start, gust_length, wind_20, height, airspeed;
    V gyro_noise, gyro_bias, gyro_walk, accelerometer[3], position_noise, velocity_noise, attitude_noise, felt_gravity, key[4];
    V centre[3], amplitude[3], frequency[3], phase[3], yaw, yaw_rate, ramp;
    V m, i[3], g, most_thrust, slope1[3], gain1[3], integral1[3], slope2[3], gain2[3], integral2[3], coupling[3], filter[3];
    V rate1, damping1, rate2, damping2, learning_start, weight_bounds[2], integral_bounds[2];
    V distance, spin;
} Numbers;

typedef struct {
    V position[3], velocity[3], attitude[4];
} Fix;

/* Everything that lives from tick to tick, in the order of `flatten`. */
typedef struct {
    V position[3], velocity[3], attitude[4], rates[3], speeds[4], charge;
    V begun, along, across[2], vertical[2];
    V bias[3 * NOISE];
    Fix queued[2], fix;
    V gyro[3];
    V integral1[3], integral2[3], weights1[N][3], weights2[N][3];
    V filtered[4], filtered_rates[3], filtered_acceleration[3], flying, force[3], wanted[4], turn, r1[3];
    V asked_thrust, asked_torque[3];
    V command[16];
    V held_speeds[4], thrust, torque[3];
} Cycle;

/* What is constant over a flight. pull, lag: of rotors that rise and fall, see `advance`. last_ramp: the block's longest. */
typedef struct {
    V per_mass, per_inertia[3], per_i[3], per_square, over_force, airborne, distance2;
    V pull[2], lag[2][4], ramp, per_ramp, half_ramp;
    V lift, roll, pitch, yaw; /* a rotor's share of each, but for its sign */
    num last_ramp;
    int swings, gusts;
} Constant;

INLINE Constant constant(const Numbers *p, num h) {
    Constant k = {0};
    V one = all(1);
    k.per_mass = one / p->mass;
    for (int i = 0; i < 3; i++) k.per_inertia[i] = one / p->inertia[i], k.per_i[i] = one / p->i[i];
    k.pull[0] = one / p->rise, k.pull[1] = one / p->fall;
    for (int i = 0; i < 2; i++) { /* what is left of a gap at each stage and after the step */
        V x = h * k.pull[i], *g = k.lag[i];
        g[0] = one - (num)0.5 * x;
        g[1] = one - (num)0.5 * x * g[0];
        g[2] = one - x * g[1];
        g[3] = one - x * (one + (num)2 * (g[0] + g[1]) + g[2]) / (num)6;
    }
    I ramped = p->ramp > 0;
    k.ramp = (V)(ramped & (I)p->ramp);
    k.per_ramp = one / pick(ramped, p->ramp, one);
    k.half_ramp = (num)0.5 * k.ramp;
    for (int i = 0; i < WIDTH; i++) k.last_ramp = k.ramp[i] > k.last_ramp ? k.ramp[i] : k.last_ramp;
    k.distance2 = p->distance * p->distance;
    k.lift = p->shares[0][0], k.roll = p->shares[0][1], k.pitch = p->shares[0][2], k.yaw = p->shares[0][3];
    k.per_square = one / p->per_square;
    k.airborne = (num)0.8 * p->m * p->g;
    k.over_force = one / (p->m * (num)GRAVITY);
    k.gusts = any((p->gust[0] != 0) | (p->gust[1] != 0) | (p->gust[2] != 0));
    k.swings = any((p->swing[0] != 0) | (p->swing[1] != 0) | (p->swing[2] != 0));
    return k;
}

typedef struct {
    V position[3], velocity[3], acceleration[3], yaw, yaw_rate;
} Reference;

/* The time along the path, its rate and the rate of that, at time t. */
INLINE V along(const Constant *k, num t, V *pace, V *change) {
    V s = t - k->half_ramp;
    *pace = all(1), *change = all(0);
    if (t < k->last_ramp) {
        V w = least(t * k->per_ramp, all(1)), rest = (num)1 - w, w2 = w * w;
        I entering = t < k->ramp;
        s = pick(entering, k->ramp * (w2 * w2 * ((num)2.5 + w * (w - (num)3))), s);
        *pace = pick(entering, w2 * w * ((num)10 + w * ((num)-15 + (num)6 * w)), all(1));
        *change = (V)(entering & (I)((num)30 * w2 * rest * rest * k->per_ramp));
    }
    return s;
}

INLINE void position(V *x, const Numbers *p, const Constant *k, num t) {
    V pace, change, s = along(k, t, &pace, &change);
    for (int i = 0; i < 3; i++) {
        V sine, cosine;
        turn(s * p->frequency[i] + p->phase[i], &sine, &cosine);
        x[i] = p->centre[i] + p->amplitude[i] * sine;
    }
}

INLINE Reference path(const Numbers *p, const Constant *k, num t) {
    Reference r;
    V pace, change, s = along(k, t, &pace, &change);
    for (int i = 0; i < 3; i++) {
        V sine, cosine;
        turn(s * p->frequency[i] + p->phase[i], &sine, &cosine);
        V across = p->amplitude[i] * sine, forth = p->amplitude[i] * p->frequency[i] * cosine;
        r.position[i] = p->centre[i] + across;
        r.velocity[i] = pace * forth;
        r.acceleration[i] = change * forth - pace * pace * (p->frequency[i] * p->frequency[i] * across);
    }
    r.yaw = p->yaw + p->yaw_rate * s, r.yaw_rate = pace * p->yaw_rate;
    return r;
}

#endif
