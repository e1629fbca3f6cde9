/*
 * TITLE on the Crazyflie, as an out-of-tree controller.
 *
 * The firmware calls this at 1 kHz. State: metres, metres a second, quaternion (x, y, z, w); gyro in degrees a second; setpoints
 * up to jerk, yaw in degrees. Commands go out in newtons and newton metres.
 *
 * The law flies setpoints that are absolute in x, y and z. All others (hover, velocity, height, level, motors off) are flown by
 * the firmware's own controllerPid, as is, after HOLD samples that the law rejected, a hover in place: level where the velocity is
 * not finite, sinking where the height is not. Where not even attitude and rates are finite, or the gyro's sample is old, no thrust.
 */
#include "stabilizer.h"
#include "stabilizer_types.h"
#include "controller.h"
#include "controller_pid.h"
#include "log.h"
#include "param.h"
#include "platform_defaults.h" /* THRUST_MAX */
#include "usec_time.h"

#include "NAME.h"
#include <math.h>
#include <string.h>

#define STEP 0.001f
#define LAW_EVERY LAW_TICKSu
#define HOLD 50u
#define GRAVITY 9.81f /* m/s^2 */
#define RADIANS 0.017453292519943295f

#define PI 3.14159265358979f
#define YAW_AHEAD 0.5f /* rad, most that a yaw turned by rates may be ahead of the vehicle */
#define WEIGHT HOVER_THRUST /* N */
#define FULL 65535.0f /* counts of a motor at THRUST_MAX */
#define SINKING 0.95f /* of the weight, carried while the height is not known */
#define LEAST_PERIOD 0.0002f
#define MOST_PERIOD 0.02f
#define SETTLING 0.1f /* s, time constant of the measured acceleration */

static NAME_params mission; /* of the export, with the firmware's thrust ceiling */
static NAME_state state_of_law;
static NAME_actuators made;
static uint32_t ticks;
static uint32_t refused;
static uint32_t rejected; /* since the law was started */
static uint64_t last; /* time of the law's last sample [us]; 0: none */
static float period; /* s, of the law's last sample */
static NAME_command command;
static uint32_t status;
static uint32_t outer[OUTER_COUNT]; /* what the slower loops returned last */
static float yaw; /* rad, asked for */
static float height; /* m, of a hover in place */
static bool started;
static float acceleration[3]; /* measured while the firmware's own controller flies [m/s^2] */
static control_t stock; /* what controllerPid commands */
static uint8_t stock_flies;

static void stop_law(void)
{
    NAME_reset(&state_of_law);
    started = false;
    refused = 0u;
    ticks = 0u;
    last = 0u;
    memset(outer, 0, sizeof outer);
    made = (NAME_actuators){0};
}

void controllerOutOfTreeInit(void)
{
    static bool loaded;
    if (!loaded)
    {
        mission = NAME_mission;
CEILING
        loaded = true; /* gains that were changed since stay so */
    }
    controllerPidInit();
    stock = (control_t){0};
    stock_flies = 0u;
    memset(acceleration, 0, sizeof acceleration);
    stop_law();
}

bool controllerOutOfTreeTest(void)
{
    return controllerPidTest();
}

/* The firmware's own controller. It starts from the present state: a setpoint without thrust resets it. */
static void fly_stock(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                      const stabilizerStep_t stabilizerStep)
{
    stabilizerStep_t step = stabilizerStep;
    if (stock_flies == 0u)
    {
        const setpoint_t nothing = {0};
        controllerPid(&stock, &nothing, sensors, state, 0);
        step = 0; /* all its loops are due */
    }
    stock_flies = 1u;
    const acc_t *felt = &state->acc; /* in units of gravity, without it */
    const float now[3] = {felt->x, felt->y, felt->z};
    for (int i = 0; i < 3; ++i)
    {
        const float here = isfinite(now[i]) ? (GRAVITY * now[i]) : 0.0f;
        acceleration[i] += (STEP / SETTLING) * (here - acceleration[i]);
    }
    controllerPid(&stock, setpoint, sensors, state, step);
    *control = stock;
}

static void measure(NAME_measured *measured, const sensorData_t *sensors, const state_t *state)
{
    *measured = (NAME_measured){0};
    measured->position[0] = state->position.x;
    measured->position[1] = state->position.y;
    measured->position[2] = state->position.z;
    measured->velocity[0] = state->velocity.x;
    measured->velocity[1] = state->velocity.y;
    measured->velocity[2] = state->velocity.z;
    measured->attitude[0] = state->attitudeQuaternion.w;
    measured->attitude[1] = state->attitudeQuaternion.x;
    measured->attitude[2] = state->attitudeQuaternion.y;
    measured->attitude[3] = state->attitudeQuaternion.z;
    measured->rates[0] = sensors->gyro.x * RADIANS;
    measured->rates[1] = sensors->gyro.y * RADIANS;
    measured->rates[2] = sensors->gyro.z * RADIANS;
    measured->thrust = made.thrust; /* what the last command made: laws that hedge need it */
    measured->torque[0] = made.torque[0];
    measured->torque[1] = made.torque[1];
    measured->torque[2] = made.torque[2];
}

/* What was commanded last, by whichever controller, as thrust and torque; false where that does not carry the vehicle. */
static bool commanded(NAME_measured *measured, const control_t *control)
{
    measured->thrust = 0.0f;
    if (control->controlMode == controlModeForceTorque)
    {
        measured->thrust = control->thrustSi;
        measured->torque[0] = control->torqueX;
        measured->torque[1] = control->torqueY;
        measured->torque[2] = control->torqueZ;
    }
    else if (control->controlMode == controlModeLegacy)
    {
        const float newtons = THRUST_MAX / FULL;
        measured->thrust = ROTOR_COUNT.0f * newtons * control->thrust;
        measured->torque[0] = ROLL_LEVER * newtons * (float)control->roll; /* half a count for each motor of a side */
        measured->torque[1] = PITCH_LEVER * newtons * (float)control->pitch;
        measured->torque[2] = YAW_LEVER * newtons * (float)control->yaw;
    }
    return measured->thrust > (0.5f * WEIGHT);
}

/* The law takes over what is commanded now, integrals and all; on the ground it begins with nothing. */
static bool begin(NAME_measured *measured, const control_t *control)
{
    if (!commanded(measured, control))
    {
        measured->thrust = WEIGHT;
        memset(measured->torque, 0, sizeof measured->torque);
        return NAME_start(&mission, &state_of_law, measured) == UPPER_OK;
    }
    NAME_reference present = {0};
    memcpy(present.position, measured->position, sizeof present.position);
    memcpy(present.velocity, measured->velocity, sizeof present.velocity);
    memcpy(present.acceleration, acceleration, sizeof present.acceleration);
    present.yaw = yaw;
    return NAME_enter(&mission, &state_of_law, measured, &present) == UPPER_OK;
}

/* of the gyro's sample [s]; a driver that leaves no time does not tell */
static float age(const sensorData_t *sensors)
{
    return (sensors->interruptTimestamp == 0u) ? 0.0f : (1e-6f * (float)(usecTimestamp() - sensors->interruptTimestamp));
}

/* Seconds since the law's last sample; its usual period at the first, and where the time repeats or goes back. */
static float since_last(const sensorData_t *sensors)
{
    const uint64_t now = (sensors->interruptTimestamp == 0u) ? usecTimestamp() : sensors->interruptTimestamp;
    const float usual = STEP * (float)LAW_EVERY;
    const float since = ((last != 0u) && (now > last)) ? (1e-6f * (float)(now - last)) : usual;
    last = now;
    return fminf(fmaxf(since, LEAST_PERIOD), MOST_PERIOD);
}

/* whether attitude and rates are finite and new: enough to stay upright */
static bool upright(const NAME_measured *measured, const float old)
{
    float sum = measured->attitude[3];
    for (int i = 0; i < 3; ++i)
    {
        sum += measured->rates[i] + measured->attitude[i];
    }
    return isfinite(sum) && (old <= mission.most_age);
}

/* A hover in place by the firmware's own controller, at the height of the first of these samples, as far as the state is known. */
static void stay(control_t *control, const NAME_measured *measured, const sensorData_t *sensors, const state_t *state,
                 const stabilizerStep_t stabilizerStep)
{
    state_t known = *state;
    setpoint_t hover = {0};
    hover.mode.yaw = modeVelocity;
    if (isfinite(measured->velocity[0] + measured->velocity[1]))
    {
        hover.mode.x = hover.mode.y = modeVelocity;
    }
    else
    {
        known.velocity.x = known.velocity.y = 0.0f; /* level */
    }
    if (isfinite(measured->position[2] + measured->velocity[2]))
    {
        height = ((stock_flies == 0u) || !isfinite(height)) ? measured->position[2] : height;
        hover.position.z = height;
        hover.mode.z = modeAbs;
    }
    else
    {
        height = NAN;
        known.position.z = known.velocity.z = 0.0f;
        hover.thrust = (SINKING * WEIGHT * FULL) / (ROTOR_COUNT.0f * THRUST_MAX);
    }
    known.position.x = isfinite(known.position.x) ? known.position.x : 0.0f;
    known.position.y = isfinite(known.position.y) ? known.position.y : 0.0f;
    fly_stock(control, &hover, sensors, &known, stabilizerStep);
}

/* the yaw that laws mean: of the level direction at right angles to the vehicle's left, whatever its tilt */
static float heading(float w, float x, float y, float z)
{
    return atan2f(2.0f * ((w * z) - (x * y)), 1.0f - (2.0f * ((x * x) + (z * z))));
}

/* an angle less whole turns, from -pi to pi */
static float turned(float angle)
{
    return angle - (2.0f * PI * floorf((angle + PI) / (2.0f * PI)));
}

/* The yaw asked for [rad]: an angle, that of an attitude (full-state setpoints), turned by a rate, or as before. */
static void want_yaw(const setpoint_t *setpoint, const NAME_measured *measured)
{
    if (setpoint->mode.yaw == modeAbs)
    {
        yaw = setpoint->attitude.yaw * RADIANS;
    }
    else if (setpoint->mode.yaw == modeVelocity)
    {
        const float *q = measured->attitude;
        const float here = heading(q[0], q[1], q[2], q[3]);
        const float ahead = turned((yaw + (setpoint->attitudeRate.yaw * RADIANS * period)) - here);
        yaw = here + fminf(fmaxf(ahead, -YAW_AHEAD), YAW_AHEAD);
    }
    else if (setpoint->mode.quat == modeAbs)
    {
        const quaternion_t *q = &setpoint->attitudeQuaternion;
        yaw = heading(q->w, q->x, q->y, q->z);
    }
}

static void want(NAME_reference *reference, const setpoint_t *setpoint)
{
    *reference = (NAME_reference){0};
    reference->position[0] = setpoint->position.x;
    reference->position[1] = setpoint->position.y;
    reference->position[2] = setpoint->position.z;
    reference->velocity[0] = setpoint->velocity.x;
    reference->velocity[1] = setpoint->velocity.y;
    reference->velocity[2] = setpoint->velocity.z;
    reference->acceleration[0] = setpoint->acceleration.x;
    reference->acceleration[1] = setpoint->acceleration.y;
    reference->acceleration[2] = setpoint->acceleration.z;
    reference->jerk[0] = setpoint->jerk.x;
    reference->jerk[1] = setpoint->jerk.y;
    reference->jerk[2] = setpoint->jerk.z; /* setpoints have no snap: it stays zero */
    reference->yaw = yaw;
    reference->yaw_rate = setpoint->attitudeRate.yaw * RADIANS;
}

void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                         const stabilizerStep_t stabilizerStep)
{
    NAME_measured measured;
    NAME_reference reference;
    (void)stabilizerStep; /* counted here, from the first sample after a switch */

    if ((setpoint->mode.x != modeAbs) || (setpoint->mode.y != modeAbs) || (setpoint->mode.z != modeAbs))
    {
        stop_law(); /* nothing is integrated or learnt meanwhile */
        fly_stock(control, setpoint, sensors, state, stabilizerStep);
        return;
    }
    measure(&measured, sensors, state);
    if ((ticks % LAW_EVERY) == 0u)
    {
        if (!started)
        {
            const float *q = measured.attitude;
            const uint32_t before = refused;
            stop_law();
            refused = before;
            rejected = (before == 0u) ? 0u : rejected;
            yaw = heading(q[0], q[1], q[2], q[3]);
            started = begin(&measured, control);
            memset(acceleration, 0, sizeof acceleration);
        }
        period = since_last(sensors);
        NAME_clock clock = {.tick = ticks, .step = STEP, .period = period, .age = age(sensors)};
        want_yaw(setpoint, &measured);
        want(&reference, setpoint);
LOOPS
        status = NAME_law(&mission, &state_of_law, &measured, &reference, &clock, &command);
        status |= OUTER_SUM;
        refused = (status == UPPER_OK) ? 0u : (refused + 1u);
        rejected += (refused == 0u) ? 0u : 1u;
        status |= NAME_made(&mission, &command, &made);
        if (refused > HOLD)
        {
            started = false; /* begins anew when the input is good again */
            made = (NAME_actuators){0};
        }
    }
    ++ticks;
    if ((refused > HOLD) && upright(&measured, age(sensors)))
    {
        stay(control, &measured, sensors, state, stabilizerStep);
        return;
    }
    stock_flies = 0u;
    control->controlMode = controlModeForceTorque;
    control->thrustSi = made.thrust;
    control->torqueX = made.torque[0];
    control->torqueY = made.torque[1];
    control->torqueZ = made.torque[2];
}

LOG_GROUP_START(quadstep)
LOG_ADD(LOG_UINT32, status, &status)
LOG_ADD(LOG_UINT32, refused, &refused)
LOG_ADD(LOG_UINT8, stock, &stock_flies)
LOG_ADD(LOG_UINT32, rejected, &rejected)
LOG_ADD(LOG_FLOAT, period, &period)
LOG_ADD(LOG_FLOAT, thrust, &made.thrust)
LOG_ADD(LOG_FLOAT, torqueX, &made.torque[0])
LOG_ADD(LOG_FLOAT, torqueY, &made.torque[1])
LOG_ADD(LOG_FLOAT, torqueZ, &made.torque[2])
LOG_ADD(LOG_FLOAT, askedThrust, &command.thrust)
LOG_ADD(LOG_FLOAT, askedX, &command.torque[0])
LOG_ADD(LOG_FLOAT, askedY, &command.torque[1])
LOG_ADD(LOG_FLOAT, askedZ, &command.torque[2])
LOG_ADD(LOG_FLOAT, askedYaw, &yaw)
LOG_GROUP_STOP(quadstep)

/* the gains, which may be changed in flight */
PARAM_GROUP_START(quadstep)
GAIN_TABLE
PARAM_GROUP_STOP(quadstep)
