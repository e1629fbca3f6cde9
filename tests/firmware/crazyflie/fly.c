/* One sample through the adapter, in the firmware's units, beside the same through the law. argv: none. Prints both commands. */
#include <stdio.h>
#include <string.h>
#include "controller.h"
#include "controller_pid.h"
#include "log.h"
#include "param.h"
#include "usec_time.h"
extern const struct log_s __logs_quadstep[];
extern const struct param_s __params_quadstep[];
#include "NAME.h"
#include "NAME_golden.h"
static uint64_t now = 1000000u;
uint64_t usecTimestamp(void) { return now; }
static const void *logged(const char *name)
{
    const struct log_s *one = __logs_quadstep;
    while (strcmp(one->name, name) != 0) { ++one; }
    return one->address;
}
/* The firmware's own controller: as far as it matters here, it is reset by a setpoint without thrust, and says what it flies. */
static int resets, flown;
static setpoint_t last;
void controllerPidInit(void) {}
bool controllerPidTest(void) { return true; }
void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state, const stabilizerStep_t step)
{
    (void)sensors; (void)state;
    const bool off = setpoint->mode.z == modeDisable && setpoint->thrust == 0.0f;
    resets += off && step == 0u;
    flown += !off;
    last = *setpoint;
    control->controlMode = controlModeLegacy;
    control->roll = control->pitch = control->yaw = 0; control->thrust = off ? 0.0f : 30000.0f;
}
int main(void)
{
    control_t control; setpoint_t setpoint; sensorData_t sensors; state_t state;
    memset(&setpoint, 0, sizeof setpoint); memset(&sensors, 0, sizeof sensors); memset(&state, 0, sizeof state);
    controllerOutOfTreeInit();
    controllerOutOfTree(&control, &setpoint, &sensors, &state, 0);
    printf("idle %d %.9g %d %d\n", (int)control.controlMode, (double)control.thrust, resets, flown);
    NAME_state law; NAME_measured measured; NAME_reference reference; NAME_command command; NAME_actuators made;
    memset(&made, 0, sizeof made); made.thrust = 0.0328f * 9.81f; /* hovering, before the first command */
    NAME_params capped = NAME_mission; capped.vehicle.allocation.most = 0.12f;
    setpoint.mode.x = setpoint.mode.y = setpoint.mode.z = setpoint.mode.yaw = modeAbs;
    for (uint32_t i = 0; i < 20; ++i)
    {
        if (i == 10u)
        {
            for (const struct param_s *one = __params_quadstep; one->name; ++one) /* in place of the law's first gain is its first parameter */
            {
                if ((strcmp(one->name, "RAT_X") != 0) && (strcmp(one->name, "GAI_2_X") != 0)) { continue; }
                *one->address *= 1.5f;
                *(float *)((char *)&capped.gains + ((const char *)one->address - (const char *)__params_quadstep[0].address)) *= 1.5f;
                printf("changed %s\n", one->name);
            }
        }
        memcpy(&measured, golden_measured[i], sizeof measured);
        memcpy(&reference, golden_reference[i], sizeof reference);
        measured.thrust = made.thrust; memcpy(measured.torque, made.torque, sizeof made.torque);
        memset(reference.snap, 0, sizeof reference.snap);
        state.position.x = measured.position[0]; state.position.y = measured.position[1]; state.position.z = measured.position[2];
        state.velocity.x = measured.velocity[0]; state.velocity.y = measured.velocity[1]; state.velocity.z = measured.velocity[2];
        state.attitudeQuaternion.w = measured.attitude[0]; state.attitudeQuaternion.x = measured.attitude[1];
        state.attitudeQuaternion.y = measured.attitude[2]; state.attitudeQuaternion.z = measured.attitude[3];
        sensors.gyro.x = measured.rates[0] * 57.29577951f; sensors.gyro.y = measured.rates[1] * 57.29577951f; sensors.gyro.z = measured.rates[2] * 57.29577951f;
        setpoint.position.x = reference.position[0]; setpoint.position.y = reference.position[1]; setpoint.position.z = reference.position[2];
        setpoint.velocity.x = reference.velocity[0]; setpoint.velocity.y = reference.velocity[1]; setpoint.velocity.z = reference.velocity[2];
        setpoint.acceleration.x = reference.acceleration[0]; setpoint.acceleration.y = reference.acceleration[1]; setpoint.acceleration.z = reference.acceleration[2];
        setpoint.jerk.x = reference.jerk[0]; setpoint.jerk.y = reference.jerk[1]; setpoint.jerk.z = reference.jerk[2];
        setpoint.attitude.yaw = reference.yaw * 57.29577951f; setpoint.attitudeRate.yaw = reference.yaw_rate * 57.29577951f;
        if (i == 0) { NAME_reset(&law); (void)NAME_start(&capped, &law, &measured); }
        /* the law takes every second of the firmware's ticks, its position loop every tenth */
        NAME_clock clock = {.tick = 2u * i, .step = 0.001f, .period = 0.010f, .age = 0.0f};
        if ((2u * i) % 10u == 0u) { (void)NAME_guide(&capped, &law, &measured, &reference, &clock); }
        clock.period = 0.002f;
        (void)NAME_law(&capped, &law, &measured, &reference, &clock, &command);
        (void)NAME_made(&capped, &command, &made);
        for (uint32_t k = 0; k < 2u; ++k)
        {
            now += 1000u; sensors.interruptTimestamp = now - 300u;
            controllerOutOfTree(&control, &setpoint, &sensors, &state, 2u * i + k);
        }
        printf("sample %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", (double)control.thrustSi, (double)control.torqueX, (double)control.torqueY,
               (double)control.torqueZ, (double)made.thrust, (double)made.torque[0], (double)made.torque[1], (double)made.torque[2]);
    }
    const int late[6] = {1000, 4000, 0, -500, 30000, 100}; /* us until the law's next sample; at first one more */
    for (int what = 0; what < 6; ++what)
    {
        now += (uint64_t)(int64_t)late[what]; sensors.interruptTimestamp += (uint64_t)(int64_t)late[what];
        for (uint32_t k = 0; k < 2u; ++k) { controllerOutOfTree(&control, &setpoint, &sensors, &state, k); }
        printf("since %.9g\n", (double)*(const float *)logged("period"));
    }
    printf("logged %.9g %.9g %.9g %.9g\n", (double)(*(const float *)logged("torqueX") - control.torqueX), (double)(*(const float *)logged("torqueY") - control.torqueY),
           (double)(*(const float *)logged("torqueZ") - control.torqueZ), (double)(*(const float *)logged("thrust") - control.thrustSi));
    const float good = state.position.x, height = setpoint.position.z, rate = sensors.gyro.y;
    for (int what = 0; what < 5; ++what)
    {
        /* spoilt one after the other: a position, a rate, the path, the switch away from a position; last the gyro's samples end */
        if (what == 0) { state.position.x = 0.0f / 0.0f; }
        if (what == 1) { sensors.gyro.y = 1.0f / 0.0f; }
        if (what == 2) { setpoint.position.z = 0.0f / 0.0f; }
        if (what == 3) { setpoint.mode.z = modeVelocity; setpoint.velocity.z = 0.25f; }
        resets = flown = 0;
        for (int i = 0; i < ((what == 4) ? 240 : 140); ++i)
        {
            now += 1000u; sensors.interruptTimestamp = (what == 4) ? sensors.interruptTimestamp : now;
            controllerOutOfTree(&control, &setpoint, &sensors, &state, 7u + (unsigned)i);
            if ((what == 4) && (i == 96)) { printf("young %u\n", *(const uint32_t *)logged("refused")); }
            if (i == ((what == 4) ? 190 : 1)) { printf("held %d %d %.9g\n", what, (int)control.controlMode, (double)control.thrustSi); }
        }
        printf("lost %d %d %.9g %d %d %d %.9g\n", what, (int)control.controlMode, (double)control.thrustSi, resets, flown > 20, (int)last.mode.z, (double)last.velocity.z);
        state.position.x = good; sensors.gyro.y = rate; setpoint.position.z = height; setpoint.mode.z = modeAbs; setpoint.velocity.z = 0.0f;
        for (int i = 0; i < 20; ++i) { now += 1000u; sensors.interruptTimestamp = now; controllerOutOfTree(&control, &setpoint, &sensors, &state, 0); }
        printf("back %d %d %.9g\n", what, (int)control.controlMode, (double)control.thrustSi);
    }
    /* level, nose to the north, where it should be; the ways in which a heading of 0.4 rad is asked for */
    memset(&setpoint, 0, sizeof setpoint); memset(&state, 0, sizeof state); memset(&sensors.gyro, 0, sizeof sensors.gyro);
    state.attitudeQuaternion.w = 1.0f;
    for (int what = 0; what < 5; ++what)
    {
        memset(&setpoint, 0, sizeof setpoint);
        controllerOutOfTree(&control, &setpoint, &sensors, &state, 0);
        setpoint.mode.x = setpoint.mode.y = setpoint.mode.z = modeAbs;
        if (what == 1) { setpoint.mode.yaw = modeAbs; setpoint.attitude.yaw = 0.4f * 57.29577951f; }
        if (what == 2) { setpoint.mode.quat = modeAbs; setpoint.attitudeQuaternion.w = 0.980066578f; setpoint.attitudeQuaternion.z = 0.198669331f; }
        if (what == 3) { setpoint.mode.yaw = modeVelocity; setpoint.attitudeRate.yaw = 4.0f * 57.29577951f; }
        if (what == 4) { setpoint.mode.yaw = modeVelocity; setpoint.attitudeRate.yaw = -400.0f * 57.29577951f; }
        for (int i = 0; i < (what == 3 ? 400 : 100); ++i) /* a rate is asked for 0.1 s; what is left of it is the angle */
        {
            now += 1000u; sensors.interruptTimestamp = now;
            controllerOutOfTree(&control, &setpoint, &sensors, &state, 0);
            if (i == 99) { setpoint.attitudeRate.yaw = 0.0f; }
        }
        printf("yaw %d %.9g\n", what, (double)control.torqueZ);
    }
    setpoint.position.z = state.position.z + 1000.0f; setpoint.acceleration.z = 1000.0f;
    for (int i = 0; i < 20; ++i) { controllerOutOfTree(&control, &setpoint, &sensors, &state, 0); }
    printf("saturated %u %.9g\n", *(const uint32_t *)logged("status"), (double)control.thrustSi);
    /* taken over where it should be, leaning and turned: from the firmware's own controller, as motors idle, from another law */
    memset(&setpoint, 0, sizeof setpoint);
    setpoint.mode.x = setpoint.mode.y = setpoint.mode.z = modeAbs;
    state.attitudeQuaternion.w = 0.99166533f; state.attitudeQuaternion.x = 0.04f; state.attitudeQuaternion.y = -0.06f; state.attitudeQuaternion.z = 0.107f;
    for (int what = 0; what < 3; ++what)
    {
        controllerOutOfTreeInit();
        memset(&control, 0, sizeof control);
        control.controlMode = controlModeLegacy;
        control.thrust = (what == 0) ? 45000.0f : 5000.0f; control.roll = 700; control.pitch = -500; control.yaw = 300;
        if (what == 2)
        {
            control.controlMode = controlModeForceTorque;
            control.thrustSi = 0.3f; control.torqueX = 1e-4f; control.torqueY = -2e-4f; control.torqueZ = 3e-5f;
        }
        controllerOutOfTree(&control, &setpoint, &sensors, &state, 0);
        printf("enters %.9g %.9g %.9g %.9g\n", (double)control.thrustSi, (double)control.torqueX, (double)control.torqueY, (double)control.torqueZ);
    }
    return 0;
}
