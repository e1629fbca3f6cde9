/* Betaflight's own rate loop and mixer over given samples, each lane a flight of its own: see tests/betaflight_stock.py. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "platform.h"

#include "build/debug.h"
#include "common/axis.h"
#include "common/filter.h"
#include "config/config.h"
#include "fc/controlrate_profile.h"
#include "fc/core.h"
#include "fc/rc.h"
#include "fc/rc_controls.h"
#include "fc/rc_modes.h"
#include "fc/runtime_config.h"
#include "flight/imu.h"
#include "flight/mixer.h"
#include "flight/mixer_init.h"
#include "flight/pid.h"
#include "flight/pid_init.h"
#include "io/gps.h"
#include "pg/motor.h"
#include "pg/pg.h"
#include "pg/pg_ids.h"
#include "pg/rx.h"
#include "rx/rx.h"
#include "sensors/acceleration.h"
#include "sensors/gyro.h"

#define LOW 0.055f

int16_t debug[DEBUG16_VALUE_COUNT];
uint8_t debugMode, armingFlags = ARMED, stateFlags;
uint16_t flightModeFlags;
gyro_t gyro;
attitudeEulerAngles_t attitude;
float rcCommand[4], rcData[18];
int16_t headFreeModeHold;
pidProfile_t *currentPidProfile;
controlRateConfig_t *currentControlRateProfile;
gpsSolutionData_t gpsSol;
float gpsRescueAngle[2];
mixerRuntime_t mixerRuntime;
static controlRateConfig_t rates;
static float asked[3], before[3];
static bool airmode = true;

PG_REGISTER(accelerometerConfig_t, accelerometerConfig, PG_ACCELEROMETER_CONFIG, 0);
PG_REGISTER(mixerConfig_t, mixerConfig, PG_MIXER_CONFIG, 0);
PG_REGISTER(rxConfig_t, rxConfig, PG_RX_CONFIG, 0);
PG_REGISTER(flight3DConfig_t, flight3DConfig, PG_MOTOR_3D_CONFIG, 0);
PG_REGISTER(motorConfig_t, motorConfig, PG_MOTOR_CONFIG, 0);

float getSetpointRate(int axis) { return asked[axis]; }
float getFeedforward(int axis) { return (asked[axis] - before[axis]) * pidGetPidFrequency(); }
bool gyroOverflowDetected(void) { return false; }
bool isLaunchControlActive(void) { return false; }
bool isAirmodeActivated(void) { return airmode; }
bool airmodeIsEnabled(void) { return airmode; }
bool isFlipOverAfterCrashActive(void) { return false; }
bool failsafeIsActive(void) { return false; }
bool featureIsEnabled(const uint32_t mask) { (void)mask; return false; }
bool mixerIsTricopter(void) { return false; }
bool isMotorProtocolDshot(void) { return true; }
void dynLpfGyroUpdate(float throttle) { (void)throttle; }
float gpsRescueGetThrottle(void) { return 0.0f; }
bool IS_RC_MODE_ACTIVE(boxId_e box) { (void)box; return false; }
bool isMotorsReversed(void) { return false; }
bool sensors(uint32_t mask) { (void)mask; return false; }
float dynThrottle(float throttle) { return throttle; }
float getMaxRcDeflectionAbs(void) { return 0.0f; }
float getMaxRcRate(int axis) { (void)axis; return 670.0f; }
float getRcDeflection(int axis) { (void)axis; return 0.0f; }
float getRcDeflectionAbs(int axis) { (void)axis; return 0.0f; }
float mixerTricopterMotorCorrection(int motor) { (void)motor; return 0.0f; }
void delay(timeMs_t ms) { (void)ms; }
void disarm(flightLogDisarmReason_e reason) { (void)reason; }
void motorWriteAll(float *values) { (void)values; }
void setArmingDisabled(armingDisableFlags_e flag) { (void)flag; }
void systemBeep(bool on) { (void)on; }

/* in: values of our parameters in the order of `SETTINGS`. */
void set(const float *v, int airmode_on)
{
    static pidProfile_t own;
    pidProfile_t *p = currentPidProfile = &own;
    resetPidProfile(p);
    for (int axis = 0; axis < 3; axis++, v += 5) {
        p->pid[axis].P = v[0], p->pid[axis].I = v[1], p->pid[axis].D = v[2], p->pid[axis].F = v[3], p->d_min[axis] = v[4];
    }
    p->dterm_notch_hz = v[0], p->dterm_notch_cutoff = v[1], p->dterm_lpf1_static_hz = v[2], p->dterm_lpf1_type = v[3];
    p->dterm_lpf1_dyn_min_hz = v[4], p->dterm_lpf1_dyn_max_hz = v[5], p->dterm_lpf1_dyn_expo = v[6];
    p->dterm_lpf2_static_hz = v[7], p->dterm_lpf2_type = v[8], p->yaw_lowpass_hz = v[9];
    v += 10;
    p->d_min_gain = v[0], p->d_min_advance = v[1], p->itermLimit = v[2], p->itermWindupPointPercent = v[3];
    p->iterm_relax = v[4], p->iterm_relax_type = v[5], p->iterm_relax_cutoff = v[6], p->pidSumLimit = v[7];
    p->pidSumLimitYaw = v[8], p->anti_gravity_gain = v[9], p->anti_gravity_p_gain = v[10], p->anti_gravity_cutoff_hz = v[11];
    p->tpa_mode = v[12], p->tpa_rate = v[13], p->tpa_breakpoint = v[14], p->throttle_boost = v[15];
    p->throttle_boost_cutoff = v[16], p->thrustLinearization = v[17];
    airmode = airmode_on;
    currentControlRateProfile = &rates;
    rates.throttle_limit_percent = 100;
    mixerConfigMutable()->yaw_motors_reversed = false;
    static const motorMixer_t quad[4] = {
        {1.0f, -1.0f, -1.0f, 1.0f}, {1.0f, -1.0f, 1.0f, -1.0f}, {1.0f, 1.0f, 1.0f, 1.0f}, {1.0f, 1.0f, -1.0f, -1.0f}};
    memset(&mixerRuntime, 0, sizeof mixerRuntime);
    mixerRuntime.motorCount = 4;
    mixerRuntime.motorOutputLow = LOW;
    mixerRuntime.motorOutputHigh = 1.0f;
    memcpy(mixerRuntime.currentMixer, quad, sizeof quad);
    gyro.targetLooptime = 1000;
}

static void sample(const float *in, float *out)
{
    for (int axis = 0; axis < 3; axis++) {
        asked[axis] = in[axis];
        gyro.gyroADCf[axis] = in[3 + axis];
    }
    pidController(currentPidProfile, 0);
    rcCommand[THROTTLE] = 1000.0f + 1000.0f * in[6];
    mixTable(0);
    const float throttle = (rcCommand[THROTTLE] - 1000.0f) / 1000.0f;
    dynLpfDTermUpdate(throttle); /* at once, and not in hundredths every 5 ms */
    for (int axis = 0; axis < 3; axis++) {
        before[axis] = asked[axis];
        out[axis] = pidData[axis].Sum;
    }
    memcpy(out + 3, motor, 4 * sizeof(float));
}

/* in: setpoints and filtered rates [deg/s], throttle. out: sums, motors. */
void fly(int lanes, int samples, const float *in, float *out)
{
    for (int lane = 0; lane < lanes; lane++) {
        float quiet[7] = {0.0f}, none[7];
        quiet[6] = in[6];
        for (int time = 0; time < 2; time++) {
            memset(&pidRuntime, 0, sizeof pidRuntime);
            memset(pidData, 0, sizeof pidData);
            memset(before, 0, sizeof before);
            pidInit(currentPidProfile);
            pidInit(currentPidProfile); /* whose filters follow what the first has set */
            pidStabilisationState(PID_STABILISATION_ON);
            pidSetAntiGravityState(true);
            if (!time) {
                sample(quiet, none);
            }
        }
        pidUpdateTpaFactor(in[6]);
        dynLpfDTermUpdate(in[6]);
        for (int i = 0; i < samples; i++, in += 7, out += 7) {
            sample(in, out);
        }
    }
}
