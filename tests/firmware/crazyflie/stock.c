/* The firmware's own loops over given samples, each lane a flight of its own: see tests/crazyflie_stock.py. */
#include <string.h>

#include "attitude_controller.h"
#include "controller_mellinger.h"
#include "pid.h"
#include "position_controller.h"
#include "power_distribution.h"
#include "stabilizer_types.h"

extern PidObject pidRollRate, pidPitchRate, pidYawRate;

int consolePutchar(int c) { return c; }
int eprintf(int (*put)(int), const char *text, ...) { (void)put; (void)text; return 0; }

static void begin(void)
{
    static int ready;
    if (!ready) {
        attitudeControllerInit(1.0f / ATTITUDE_RATE);
        positionControllerInit();
        ready = 1;
    }
    attitudeControllerResetAllPID(0.0f, 0.0f, 0.0f);
    positionControllerResetAllPID(0.0f, 0.0f, 0.0f);
    positionControllerResetAllfilters();
}

/* in: measured roll, pitch, yaw [deg], wanted ones. out: wanted rates [deg/s]. */
void attitude(int lanes, int samples, const float *in, float *out)
{
    for (int lane = 0; lane < lanes; lane++) {
        begin();
        for (int i = 0; i < samples; i++, in += 6, out += 3) {
            attitudeControllerCorrectAttitudePID(in[0], in[1], in[2], in[3], in[4], in[5], out, out + 1, out + 2);
        }
    }
}

static void three(int lanes, int samples, const float *in, float *out, bool smooth)
{
    PidObject *loops[3] = {&pidRollRate, &pidPitchRate, &pidYawRate};
    for (int lane = 0; lane < lanes; lane++) {
        begin();
        for (int axis = 0; axis < 3; axis++) {
            filterReset(loops[axis], ATTITUDE_RATE, 30.0f, smooth);
        }
        for (int i = 0; i < samples; i++, in += 6, out += 3) {
            for (int axis = 0; axis < 3; axis++) {
                pidSetDesired(loops[axis], in[3 + axis]);
                out[axis] = pidUpdate(loops[axis], in[axis], false);
            }
        }
    }
}

/* in: measured rates [deg/s], wanted ones. out: counts, before they are rounded. */
void rates(int lanes, int samples, const float *in, float *out)
{
    three(lanes, samples, in, out, false);
}

/* The same with the D parts filtered, as by pid_rate.rateFiltEn. */
void filtered(int lanes, int samples, const float *in, float *out)
{
    three(lanes, samples, in, out, true);
}

/* in: position, velocity, yaw [deg], wanted position. out: thrust [counts], roll, pitch [deg]. */
void position(int lanes, int samples, const float *in, float *out)
{
    for (int lane = 0; lane < lanes; lane++) {
        begin();
        for (int i = 0; i < samples; i++, in += 10, out += 3) {
            setpoint_t wanted = {.mode = {.x = modeAbs, .y = modeAbs, .z = modeAbs, .yaw = modeAbs}};
            state_t state = {0};
            attitude_t tilt = {0};
            state.position.x = in[0]; state.position.y = in[1]; state.position.z = in[2];
            state.velocity.x = in[3]; state.velocity.y = in[4]; state.velocity.z = in[5];
            state.attitude.yaw = in[6];
            wanted.position.x = in[7]; wanted.position.y = in[8]; wanted.position.z = in[9];
            positionController(out, &tilt, &wanted, &state);
            out[1] = tilt.roll; out[2] = tilt.pitch;
        }
    }
}

/* in: position, velocity, quaternion (w, x, y, z), gyro [deg/s], wanted position, velocity, acceleration, yaw [deg], rates
 * [deg/s]. out: the motors [counts]. */
void mellinger(int lanes, int samples, const float *in, float *out)
{
    for (int lane = 0; lane < lanes; lane++) {
        controllerMellinger_t law;
        memset(&law, 0, sizeof law);
        controllerMellingerInit(&law);
        law.prev_omega_roll = law.prev_omega_pitch = __builtin_nanf("");
        for (int i = 0; i < samples; i++, in += 26, out += 4) {
            setpoint_t wanted = {.mode = {.x = modeAbs, .y = modeAbs, .z = modeAbs, .yaw = modeAbs}};
            state_t state = {0};
            sensorData_t sensors = {0};
            control_t control = {0};
            motors_thrust_uncapped_t asked;
            motors_thrust_pwm_t made;
            state.position.x = in[0]; state.position.y = in[1]; state.position.z = in[2];
            state.velocity.x = in[3]; state.velocity.y = in[4]; state.velocity.z = in[5];
            state.attitudeQuaternion.w = in[6]; state.attitudeQuaternion.x = in[7];
            state.attitudeQuaternion.y = in[8]; state.attitudeQuaternion.z = in[9];
            sensors.gyro.x = in[10]; sensors.gyro.y = in[11]; sensors.gyro.z = in[12];
            wanted.position.x = in[13]; wanted.position.y = in[14]; wanted.position.z = in[15];
            wanted.velocity.x = in[16]; wanted.velocity.y = in[17]; wanted.velocity.z = in[18];
            wanted.acceleration.x = in[19]; wanted.acceleration.y = in[20]; wanted.acceleration.z = in[21];
            wanted.attitude.yaw = in[22];
            wanted.attitudeRate.roll = in[23]; wanted.attitudeRate.pitch = in[24]; wanted.attitudeRate.yaw = in[25];
            controllerMellinger(&law, &control, &wanted, &sensors, &state, 0);
            powerDistribution(&control, &asked);
            powerDistributionCap(&asked, &made);
            for (int motor = 0; motor < 4; motor++) {
                out[motor] = made.list[motor];
            }
        }
    }
}
