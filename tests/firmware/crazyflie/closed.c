/* The adapter with the firmware's own controllerPid and power distribution, from its tree, around a rigid body of our own: what
 * follows from setpoints of all kinds. Prints a line a scenario: its name, the height [m], the distance from where it should be [m],
 * the yaw [deg], the lowest height [m], the largest tilt [deg] and the largest distance from there [m] of it. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "autoconf.h"
#include "controller.h"
#include "power_distribution.h"
#include "platform_defaults.h"
#include "usec_time.h"

#define DEGREES 57.29577951308232

static uint64_t now = 1000000u;
uint64_t usecTimestamp(void) { return now; }
int consolePutchar(int c) { return c; }
int eprintf(int (*put)(int), const char *text, ...) { (void)put; (void)text; return 0; }

/* position, velocity: world, z up; q: body to world, w first; rates: body; force of each motor [N] */
static struct { double position[3], velocity[3], q[4], rates[3], force[4]; } body;
static const double MASS = 0.0328, INERTIA[3] = {1.68e-5, 1.68e-5, 2.98e-5}, ARM = 0.03253, SWIRL = 0.0070, LAG = 0.05, DRAG = 0.008;
static const double AHEAD[4] = {1, -1, -1, 1}, LEFT[4] = {-1, -1, 1, 1}, TURN[4] = {-1, 1, -1, 1};

static double push[2]; /* of a wind [N] */
static double felt[3]; /* acceleration, world [m/s^2] */

static void fly_on(const uint16_t *pwm, double step)
{
    double lift = 0.0, torque[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < 4; ++i)
    {
        body.force[i] += step / LAG * (pwm[i] / 65535.0 * (double)THRUST_MAX - body.force[i]);
        lift += body.force[i];
        torque[0] += LEFT[i] * ARM * body.force[i];
        torque[1] -= AHEAD[i] * ARM * body.force[i];
        torque[2] += TURN[i] * SWIRL * body.force[i];
    }
    double *q = body.q, *r = body.rates;
    const double up[3] = {2.0 * (q[1] * q[3] + q[0] * q[2]), 2.0 * (q[2] * q[3] - q[0] * q[1]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2])};
    for (int i = 0; i < 3; ++i)
    {
        felt[i] = (lift * up[i] - DRAG * body.velocity[i] + (i < 2 ? push[i] : 0.0)) / MASS - (i == 2 ? 9.81 : 0.0);
        body.velocity[i] += step * felt[i];
        body.position[i] += step * body.velocity[i];
    }
    const double turning[3] = {torque[0] - r[1] * r[2] * (INERTIA[2] - INERTIA[1]), torque[1] - r[2] * r[0] * (INERTIA[0] - INERTIA[2]), torque[2]};
    for (int i = 0; i < 3; ++i) { r[i] += step * turning[i] / INERTIA[i]; }
    const double dq[4] = {-q[1] * r[0] - q[2] * r[1] - q[3] * r[2], q[0] * r[0] + q[2] * r[2] - q[3] * r[1],
                          q[0] * r[1] + q[3] * r[0] - q[1] * r[2], q[0] * r[2] + q[1] * r[1] - q[2] * r[0]};
    double size = 0.0;
    for (int i = 0; i < 4; ++i) { q[i] += 0.5 * step * dq[i]; size += q[i] * q[i]; }
    for (int i = 0; i < 4; ++i) { q[i] /= sqrt(size); }
}

static double yaw_of(void) { const double *q = body.q; return DEGREES * atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3])); }

enum lost { NOTHING = 0, PLACE, HEIGHT, POSITION, STATE };

/* lost: what is not finite for the first half second */
static void fly(const char *name, const setpoint_t *setpoint, double seconds, enum lost lost)
{
    static control_t control;
    static uint32_t tick;
    double lowest = 1e9, tilt = 0.0, farthest = 0.0;
    for (int i = 0; i < (int)(seconds * 1000.0); ++i, ++tick)
    {
        const double *q = body.q;
        sensorData_t sensors = {0}; state_t state = {0};
        now += 1000u; sensors.interruptTimestamp = now;
        sensors.gyro.x = (float)(DEGREES * body.rates[0]); sensors.gyro.y = (float)(DEGREES * body.rates[1]); sensors.gyro.z = (float)(DEGREES * body.rates[2]);
        state.position.x = (float)body.position[0]; state.position.y = (float)body.position[1]; state.position.z = (float)body.position[2];
        state.velocity.x = (float)body.velocity[0]; state.velocity.y = (float)body.velocity[1]; state.velocity.z = (float)body.velocity[2];
        state.attitudeQuaternion.w = (float)q[0]; state.attitudeQuaternion.x = (float)q[1]; state.attitudeQuaternion.y = (float)q[2]; state.attitudeQuaternion.z = (float)q[3];
        state.acc.x = (float)(felt[0] / 9.81); state.acc.y = (float)(felt[1] / 9.81); state.acc.z = (float)(felt[2] / 9.81);
        state.attitude.roll = (float)(DEGREES * atan2(2.0 * (q[0] * q[1] + q[2] * q[3]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2])));
        state.attitude.pitch = (float)(-DEGREES * asin(2.0 * (q[0] * q[2] - q[3] * q[1]))); /* the firmware's is inverted */
        state.attitude.yaw = (float)yaw_of();
        if (lost != NOTHING && i < 500)
        {
            state.position.x = (lost == HEIGHT) ? state.position.x : NAN;
            if (lost >= HEIGHT) { state.position.z = NAN; }
            if (lost >= POSITION) { state.velocity.x = state.velocity.y = state.velocity.z = state.position.y = NAN; }
            if (lost == STATE) { state.attitudeQuaternion.w = NAN; }
        }
        controllerOutOfTree(&control, setpoint, &sensors, &state, tick);
        motors_thrust_uncapped_t uncapped; motors_thrust_pwm_t pwm;
        powerDistribution(&control, &uncapped);
        (void)powerDistributionCap(&uncapped, &pwm);
        fly_on(pwm.list, 0.001);
        lowest = fmin(lowest, body.position[2]);
        farthest = fmax(farthest, hypot(body.position[0] - (double)setpoint->position.x, body.position[1] - (double)setpoint->position.y));
        tilt = fmax(tilt, DEGREES * acos(1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2])));
    }
    const double away = hypot(body.position[0] - (double)setpoint->position.x, body.position[1] - (double)setpoint->position.y);
    if (name != NULL) { printf("%s %.4f %.4f %.2f %.4f %.1f %.4f\n", name, body.position[2], away, yaw_of(), lowest, tilt, farthest); }
}

/* A circle of 2 m in 10 s, from rest to its speed in 5 s, with velocity, acceleration and, then, jerk; prints the RMSE of the last 10 s as the distance. */
static void circle(const char *name, const setpoint_t *start)
{
    const double full = 6.283185307179586 / 10.0, radius = 2.0;
    setpoint_t at = *start;
    double sum = 0.0, farthest = 0.0;
    int count = 0;
    for (int i = 0; i < 22500; i += 2)
    {
        const double t = 0.001 * i, gain = (t < 5.0) ? (full / 5.0) : 0.0, speed = (t < 5.0) ? (gain * t) : full;
        const double phase = (t < 5.0) ? (0.5 * gain * t * t) : (full * (t - 2.5)), c = cos(phase), s = sin(phase);
        at.position.x = (float)((double)start->position.x + radius * (1.0 - c)); at.position.y = (float)((double)start->position.y + radius * s);
        at.velocity.x = (float)(radius * speed * s); at.velocity.y = (float)(radius * speed * c);
        at.acceleration.x = (float)(radius * (gain * s + speed * speed * c)); at.acceleration.y = (float)(radius * (gain * c - speed * speed * s));
        at.jerk.x = (float)(-radius * speed * speed * speed * s); at.jerk.y = (float)(-radius * speed * speed * speed * c);
        const double x = body.position[0] - (double)at.position.x, y = body.position[1] - (double)at.position.y, z = body.position[2] - (double)at.position.z;
        fly(NULL, &at, 0.002, NOTHING);
        if (i >= 12500) { sum += x * x + y * y + z * z; farthest = fmax(farthest, sqrt(x * x + y * y + z * z)); ++count; }
    }
    printf("%s %.4f %.4f %.2f %.4f %.1f %.4f\n", name, body.position[2], sqrt(sum / count), yaw_of(), body.position[2], 0.0, farthest);
}

int main(void)
{
    memset(&body, 0, sizeof body);
    body.q[0] = 1.0; body.position[2] = 1.0;
    for (int i = 0; i < 4; ++i) { body.force[i] = MASS * 9.81 / 4.0; }
    controllerOutOfTreeInit();
    setpoint_t place = {0};
    place.position.z = 1.0f;
    place.mode.x = place.mode.y = place.mode.z = place.mode.yaw = modeAbs;
    fly("absolute", &place, 3.0, NOTHING);
    setpoint_t hover = {0}; /* of MotionCommander, the flow deck, a joystick */
    hover.position.z = 1.0f; hover.velocity.x = 0.3f; hover.velocity_body = true;
    hover.mode.x = hover.mode.y = modeVelocity; hover.mode.z = modeAbs; hover.mode.yaw = modeVelocity;
    hover.attitudeRate.yaw = 20.0f;
    fly("hover", &hover, 3.0, NOTHING);
    fly("back", &place, 4.0, NOTHING);
    setpoint_t level = {0}; /* the firmware's after half a second without a link */
    level.position.z = 1.0f; level.mode.z = modeAbs; level.mode.roll = level.mode.pitch = modeAbs; level.mode.yaw = modeVelocity;
    fly("level", &level, 2.0, NOTHING);
    fly("again", &place, 4.0, NOTHING);
    setpoint_t full = place; /* a full-state setpoint: its yaw is in its attitude */
    full.mode.yaw = modeDisable; full.mode.quat = modeAbs;
    full.attitudeQuaternion.w = full.attitudeQuaternion.z = 0.70710678f;
    fly("full", &full, 4.0, NOTHING);
    setpoint_t turning = place;
    turning.mode.yaw = modeVelocity; turning.attitudeRate.yaw = 45.0f;
    fly("turning", &turning, 2.0, NOTHING);
    turning.attitudeRate.yaw = 0.0f;
    fly("turned", &turning, 2.0, NOTHING);
    setpoint_t wrong = place; /* a path that is not finite: hovers in place, by the firmware's own controller */
    wrong.velocity.x = NAN;
    fly("wrong", &wrong, 2.0, NOTHING);
    fly("righted", &place, 4.0, NOTHING);
    circle("circle", &place);
    fly("stopped", &place, 4.0, NOTHING);
    push[0] = 0.04; push[1] = -0.03; /* the firmware's own controller holds against a wind; the law takes over where it is */
    hover.velocity.x = 0.0f; hover.attitudeRate.yaw = 0.0f;
    fly("leaning", &hover, 8.0, NOTHING);
    place.position.x = (float)body.position[0]; place.position.y = (float)body.position[1]; place.position.z = (float)body.position[2];
    place.attitude.yaw = (float)yaw_of();
    fly("entry", &place, 3.0, NOTHING);
    circle("gusty", &place);
    push[0] = push[1] = 0.0;
    place.position.z = 3.0f;
    fly(NULL, &place, 6.0, NOTHING);
    fly("lost", &place, 4.0, PLACE);
    fly("deep", &place, 4.0, HEIGHT);
    fly("blind", &place, 4.0, POSITION);
    fly("gone", &place, 4.0, STATE);
    fly("off", &(setpoint_t){0}, 0.1, NOTHING);
    return 0;
}
