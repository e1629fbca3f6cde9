/* Turbulence around a real vehicle, and its sensors' noise. */
#ifndef VEHICLE_NOISE_H
#define VEHICLE_NOISE_H
#include "noise.h"
#include "rotations.h"
#include "vehicle.h"

#define AIR 0
#define IMU 16
#define FIX 17
#define FEET ((num)(1 / 0.3048))
#define FOR_EVER 50

/* What is constant over a flight. steps: of level and vertical turbulence, the first and all others. ahead: of the wind. */
typedef struct {
    Key key;
    Step steps[2][2];
    V ahead[2], gyro, walk;
} Noise;

INLINE Noise noise_of(const Numbers *p, num h, num air, num fix) {
    Noise n = {.key = key_of(p->key)};
    V shape = logarithm((num)0.177 + (num)0.000823 * FEET * p->height), vertical = (num)0.1 * p->wind_20;
    V length = p->height * exponential((num)-1.2 * shape), level = vertical * exponential((num)-0.4 * shape);
    n.steps[0][0] = step_of(all(FOR_EVER), level), n.steps[0][1] = step_of(all(FOR_EVER), vertical);
    V airspeed = pick(p->airspeed > 0, p->airspeed, root(dot(p->wind, p->wind))); /* 0 stands for the mean wind's */
    n.steps[1][0] = step_of(air * airspeed / length, level);
    n.steps[1][1] = step_of(air * airspeed / p->height, vertical);
    V speed = root(p->wind[0] * p->wind[0] + p->wind[1] * p->wind[1]);
    I windy = speed > 0;
    n.ahead[0] = pick(windy, p->wind[0] / pick(windy, speed, all(1)), all(1));
    n.ahead[1] = pick(windy, p->wind[1] / pick(windy, speed, all(1)), all(0));
    n.gyro = p->gyro_noise / root(all(h));
    n.walk = p->gyro_walk * root(all(fix));
    return n;
}

/* The turbulence one period later, and the wind with it. */
INLINE void stir(V *wind, Cycle *c, const Numbers *p, const Noise *n, int64_t tick) {
    const num root_3 = (num)1.7320508075688772;
    V draws[6], spare[2];
    normals(draws, &n->key, 3, AIR, (uint32_t)tick);
    const Step *step = n->steps[tick > 0];
    spare[0] = c->along, spare[1] = all(0);
    take(spare, &step[0], draws[0], all(0));
    c->along = spare[0];
    take(c->across, &step[0], draws[1], draws[2]);
    take(c->vertical, &step[1], draws[3], draws[4]);
    V u = (num)1.4142135623730951 * c->along, v = root_3 * c->across[0] + ((num)1 - root_3) * c->across[1];
    wind[0] = p->wind[0] + (n->ahead[0] * u - n->ahead[1] * v);
    wind[1] = p->wind[1] + (n->ahead[1] * u + n->ahead[0] * v);
    wind[2] = p->wind[2] + (root_3 * c->vertical[0] + ((num)1 - root_3) * c->vertical[1]);
}

/* The noise of a sample of the gyro. */
INLINE void sense(Cycle *c, const Noise *n, int64_t tick) {
    V draws[4];
    normals(draws, &n->key, 2, IMU, (uint32_t)tick);
    for (int i = 0; i < 3; i++) c->gyro[i] += c->bias[i] + n->gyro * draws[i];
}

/* The noise of a fix; the gyro's bias wanders. */
INLINE void disturb(Cycle *c, const Numbers *p, const Noise *n, int64_t tick) {
    V draws[12], v[3], small[4], true_attitude[4];
    normals(draws, &n->key, 6, FIX, (uint32_t)tick);
    memcpy(true_attitude, c->fix.attitude, sizeof true_attitude);
    for (int i = 0; i < 3; i++) {
        c->fix.position[i] += p->position_noise * draws[i];
        c->fix.velocity[i] += p->velocity_noise * draws[3 + i];
        v[i] = p->attitude_noise * draws[6 + i];
        c->bias[i] += n->walk * draws[9 + i];
    }
    turned(small, v);
    product(c->fix.attitude, true_attitude, small, 1);
}

#endif
