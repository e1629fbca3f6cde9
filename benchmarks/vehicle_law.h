/* A real vehicle's controller: position loop, attitude loop, rotors' shares. */
#ifndef VEHICLE_LAW_H
#define VEHICLE_LAW_H
#include "rotations.h"
#include "vehicle.h"

INLINE V share_made(V missing, V asked) { return most((num)1 - (num)10 * missing / most(asked, all((num)1e-6)), all(0)); }

INLINE V shrink(V length, V bound) {
    I beyond = length > bound;
    return pick(beyond, bound / pick(beyond, length, all(1)), all(1));
}

INLINE void project(V *x, int count, V square, V bound) {
    if (any(square > bound * bound)) { /* rare */
        V factor = shrink(root(square), bound);
        for (int i = 0; i < count; i++) x[i] *= factor;
    }
}

/* Position loop (Eqs 11-24), learning (Eq. 54). up: b3 of the last fix. limited: whether any rotor was at a limit. */
INLINE void guide(Cycle *c, const Numbers *p, const Constant *k, const num *weights, const V *up, num t, num period,
                  int limited) {
    Reference reference = path(p, k, t);
    V e1[3], *r1 = c->r1, chi[9], mu[N], y[3], want[3];
    c->flying = pick(c->thrust > k->airborne, all(1), c->flying);
    V on = (V)((t >= p->learning_start) & (I)c->flying);
    for (int i = 0; i < 3; i++) {
        e1[i] = reference.position[i] - c->fix.position[i];
        r1[i] = reference.velocity[i] - c->fix.velocity[i] + p->slope1[i] * e1[i];
        chi[i] = c->fix.velocity[i] * ((num)1 / SPEED), chi[3 + i] = up[i], chi[6 + i] = c->force[i] * k->over_force;
    }
    net(mu, weights, chi, 9);
    output(y, c->weights1, mu);
    for (int i = 0; i < 3; i++) {
        want[i] = reference.acceleration[i] - p->slope1[i] * p->slope1[i] * e1[i] + on * y[i];
        want[i] += p->gain1[i] * r1[i] + p->integral1[i] * c->integral1[i];
    }
    V x = p->m * want[0], z = p->m * want[1], lift = p->m * (want[2] + p->g);
    lift = clamp(lift, (num)0.1 * p->most_thrust, (num)0.95 * p->most_thrust);
    V sideways = shrink(root(x * x + z * z), root(p->most_thrust * p->most_thrust - lift * lift));
    c->force[0] = sideways * x, c->force[1] = sideways * z, c->force[2] = lift;
    V made = limited ? share_made(size(c->asked_thrust - c->thrust), size(c->asked_thrust)) : all(1);
    V learning = on * made * period, square = dot(r1, r1);
    learn(c->weights1, mu, r1, p->rate1 * learning, (num)1 - p->damping1 * p->rate1 * learning * root(square));
    project(c->weights1[0], 3 * N, weight_square(c->weights1), p->weight_bounds[0]);
    V share = c->flying * made * period;
    for (int i = 0; i < 3; i++) c->integral1[i] += share * r1[i];
    project(c->integral1, 3, dot(c->integral1, c->integral1), p->integral_bounds[0]);
    c->turn = reference.yaw_rate * attitude_for(c->wanted, c->force, reference.yaw);
}

/* The rotors' thrusts where one is at a limit: tilt before thrust before yaw. */
static __attribute__((noinline)) void within_limits(const Numbers *p, V thrust, const V *torque, V *thrusts, V *made) {
    V tilt[4], slope[4], yaw[4], kept, carried[4], lifted;
    V bottom = p->least / p->shares[0][0], top = p->most / p->shares[0][0], low, high;
    for (int i = 0; i < 4; i++) {
        tilt[i] = p->shares[i][1] * torque[0] + p->shares[i][2] * torque[1];
        yaw[i] = p->shares[i][3] * torque[2];
        slope[i] = tilt[i] / p->shares[i][0];
    }
    V steepest = most(most(slope[0], slope[1]), most(slope[2], slope[3]));
    V flattest = least(least(slope[0], slope[1]), least(slope[2], slope[3]));
    V room = top - bottom, asked = steepest - flattest;
    kept = pick(asked > room, room / most(asked, room), all(1));
    low = bottom - kept * flattest, high = top - kept * steepest;
    lifted = least(high, most(low, thrust));
    V share = all(1);
    for (int i = 0; i < 4; i++) {
        carried[i] = lifted * p->shares[i][0] + kept * tilt[i];
        V space = pick(yaw[i] > 0, p->most - carried[i], carried[i] - p->least), part = size(yaw[i]);
        share = least(share, pick(part > size(space), most(space, all(0)) / most(part, size(space) + (num)1e-30), all(1)));
    }
    for (int i = 0; i < 4; i++) thrusts[i] = least(p->most, most(p->least, carried[i] + share * yaw[i]));
    made[0] = lifted, made[1] = kept * torque[0], made[2] = kept * torque[1], made[3] = share * torque[2];
}

/* Rotor speeds for what is asked; whether any rotor is at a limit. */
INLINE int allocate(Cycle *c, const Numbers *p, const Constant *k) {
    V lift = k->lift * c->asked_thrust, roll = k->roll * c->asked_torque[0], pitch = k->pitch * c->asked_torque[1];
    V yaw = k->yaw * c->asked_torque[2], left = lift + roll, right = lift - roll, fore = yaw + pitch, aft = yaw - pitch;
    V thrusts[4] = {left + fore, left - fore, right + aft, right - aft};
    V spread = size(roll) + size(pitch) + size(yaw);
    int limited = any(~((lift - spread >= p->least) & (lift + spread <= p->most)));
    c->thrust = c->asked_thrust;
    for (int i = 0; i < 3; i++) c->torque[i] = c->asked_torque[i];
    if (limited) { /* rare */
        V made[4];
        within_limits(p, c->asked_thrust, c->asked_torque, thrusts, made);
        c->thrust = made[0];
        for (int i = 0; i < 3; i++) c->torque[i] = made[1 + i];
    }
    for (int i = 0; i < 4; i++) c->held_speeds[i] = root(thrusts[i] * k->per_square);
    return limited;
}

/* Attitude loop (Eqs 27-35): command filter, net, torque, learning (Eq. 54). known: of the net's sums, what a fix decides. */
INLINE void follow(Cycle *c, const Numbers *p, const Constant *k, const num *weights, const V *known, num t, num h,
                   int limited) {
    V made = all(1), hedge[3] = {{0}}, away[3], acceleration[3], step[3], small[4], q[4], between[4], e2[3], b[3][3];
    V rates[3], change[3], r2[3], y[3], crossed[3], spun[3], chi[6], mu[N];
    if (limited) {
        V missing[3];
        for (int i = 0; i < 3; i++) missing[i] = c->asked_torque[i] - c->torque[i], hedge[i] = k->per_i[i] * missing[i];
        made = share_made(root(dot(missing, missing)), root(dot(c->asked_torque, c->asked_torque)));
    }
    product(q, c->filtered, c->wanted, -1);
    turn_of(away, q);
    for (int i = 0; i < 3; i++) {
        V lead = (i == 2 ? c->turn : all(0)) - c->filtered_rates[i];
        acceleration[i] = p->filter[i] * (p->filter[i] * away[i] + (num)2 * lead);
        c->filtered_rates[i] += h * (acceleration[i] - hedge[i]);
        step[i] = h * c->filtered_rates[i];
    }
    turned(small, step);
    product(q, c->filtered, small, 1);
    straighten(q);
    for (int i = 0; i < 4; i++) c->filtered[i] = q[i];
    product(between, c->fix.attitude, q, -1);
    turn_of(e2, between);
    rotation(b, between);
    for (int i = 0; i < 3; i++) rates[i] = dot(b[i], c->filtered_rates), change[i] = dot(b[i], acceleration);
    cross(crossed, c->gyro, rates);
    for (int i = 0; i < 3; i++) {
        change[i] -= crossed[i];
        rates[i] -= c->gyro[i];
        r2[i] = rates[i] + p->slope2[i] * e2[i];
        chi[i] = c->gyro[i] * ((num)1 / RATE), chi[3 + i] = change[i] * ((num)1 / TURN);
    }
    for (int j = 0; j < N; j++) {
        const num *w = weights + 10 * j;
        V s = known[j] + w[3] * chi[0] + w[5] * chi[2] + w[7] * chi[4], u = w[4] * chi[1] + w[6] * chi[3] + w[8] * chi[5];
        mu[j] = sigmoid(s + u);
    }
    output(y, c->weights2, mu);
    V on = (V)((t >= p->learning_start) & (I)c->flying);
    for (int i = 0; i < 3; i++) spun[i] = p->i[i] * c->gyro[i];
    cross(crossed, c->gyro, spun);
    V learning = on * made * h, share = c->flying * made * h;
    for (int i = 0; i < 3; i++) {
        V want = change[i] + p->slope2[i] * rates[i] + on * y[i];
        want += p->gain2[i] * r2[i] + p->integral2[i] * c->integral2[i] + p->coupling[i] * e2[i];
        c->asked_torque[i] = p->i[i] * want + crossed[i];
        c->integral2[i] += share * r2[i];
    }
    learn(c->weights2, mu, r2, p->rate2 * learning, (num)1 - p->damping2 * p->rate2 * learning * root(dot(r2, r2)));
    project(c->weights2[0], 3 * N, weight_square(c->weights2), p->weight_bounds[1]);
    project(c->integral2, 3, dot(c->integral2, c->integral2), p->integral_bounds[1]);
}

#endif
