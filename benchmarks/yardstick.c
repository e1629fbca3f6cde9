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
#include "yardstick.h"

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

/* Flies `blocks` blocks of WIDTH flights through `last` ticks of `step`, the law every tick, a score every every[1] ticks. */
void fly(int64_t blocks, int64_t last, const int64_t *every, num h, const num *weights1, const num *weights2,
         const Numbers *numbers, Cycle *cycles, Score *scores) {
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
            int due = tick % every[1] == 0;
            V norm = due ? most(weight_square(c.weights1), weight_square(c.weights2)) : all(0);
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
            if (any(failed)) { /* rare */
                V code = pick(size(c.attitude[1]) < p->pitch, all(0), all(3));
                code = pick(spin < p->spin, code, all(4));
                code = pick(off2 < distance2, code, all(2));
                code = pick(sum < (num)1e30, code, all(1));
                if (!end(&score, failed, code, tick)) break;
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
            if (due) sample(&score, tick == 0, off2, u, tau, norm);
            if (tick < last) advance(&c, p, per_mass, h);
        }
        cycles[block] = c;
        scores[block] = score;
    }
}

LAYOUT
