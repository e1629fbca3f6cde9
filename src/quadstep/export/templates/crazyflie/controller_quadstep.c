/*
 * TITLE on the Crazyflie, as an out-of-tree controller.
 *
 * The firmware calls this at 1 kHz. State: metres, metres a second, quaternion (x, y, z, w); gyro in degrees a second; setpoints
 * up to jerk, yaw in degrees. Commands go out in newtons and newton metres. A setpoint without a position: no thrust; nor where
 * numbers are not finite, the gyro's sample is old, or the law gave up, for longer than HOLD samples.
 */
#include "stabilizer.h"
#include "stabilizer_types.h"
#include "controller.h"
#include "log.h"
#include "usec_time.h"

#include "NAME.h"
#include <string.h>

#define STEP 0.001f
#define LAW_EVERY LAW_TICKSu
#define HOLD 50u
#define RADIANS 0.017453292519943295f

static NAME_state state_of_law;
static NAME_actuators made;
static uint32_t ticks;
static uint32_t refused;
static uint32_t status;
static uint32_t outer[OUTER_COUNT]; /* what the slower loops returned last */
static bool started;

void controllerOutOfTreeInit(void)
{
    NAME_reset(&state_of_law);
    started = false;
    refused = 0u;
    ticks = 0u;
    memset(outer, 0, sizeof outer);
    made = (NAME_actuators){0};
}

bool controllerOutOfTreeTest(void)
{
    return true;
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

/* of the gyro's sample [s]; a driver that leaves no time does not tell */
static float age(const sensorData_t *sensors)
{
    return (sensors->interruptTimestamp == 0u) ? 0.0f : (1e-6f * (float)(usecTimestamp() - sensors->interruptTimestamp));
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
    reference->yaw = setpoint->attitude.yaw * RADIANS;
    reference->yaw_rate = setpoint->attitudeRate.yaw * RADIANS;
}

void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                         const stabilizerStep_t stabilizerStep)
{
    NAME_measured measured;
    NAME_reference reference;
    NAME_command command;
    (void)stabilizerStep; /* counted here, from the first sample after a switch */

    control->controlMode = controlModeForceTorque;
    if ((setpoint->mode.x != modeAbs) || (setpoint->mode.y != modeAbs) || (setpoint->mode.z != modeAbs))
    {
        controllerOutOfTreeInit(); /* nothing to follow: nothing is integrated or learnt meanwhile */
    }
    else if ((ticks % LAW_EVERY) == 0u)
    {
        NAME_clock clock = {.tick = ticks, .step = STEP, .period = STEP * (float)LAW_EVERY, .age = age(sensors)};
        measure(&measured, sensors, state);
        want(&reference, setpoint);
        if (!started)
        {
            started = NAME_start(&NAME_mission, &state_of_law, &measured) == UPPER_OK;
        }
LOOPS
        status = NAME_law(&NAME_mission, &state_of_law, &measured, &reference, &clock, &command);
        status |= OUTER_SUM;
        refused = (status == UPPER_OK) ? 0u : (refused + 1u);
        status |= NAME_made(&NAME_mission, &command, &made);
        if (refused > HOLD)
        {
            made = (NAME_actuators){0};
        }
        ++ticks;
    }
    else
    {
        ++ticks;
    }
    control->thrustSi = made.thrust;
    control->torqueX = made.torque[0];
    control->torqueY = made.torque[1];
    control->torqueZ = made.torque[2];
}

LOG_GROUP_START(quadstep)
LOG_ADD(LOG_UINT32, status, &status)
LOG_ADD(LOG_UINT32, refused, &refused)
LOG_ADD(LOG_FLOAT, thrust, &made.thrust)
LOG_GROUP_STOP(quadstep)
