/*
 * TITLE as a back end of ArduPilot's AC_CustomControl.
 *
 * A back end returns what goes to the mixer for roll, pitch and yaw; thrust and position stay ArduPilot's. So the law is told
 * that it is on its path, and asked for the acceleration whose thrust points where ArduPilot wants it, and for the jerk and the
 * yaw rate with which that turns: the attitude and the rates that the law then wants are ArduPilot's. ArduPilot's body axes are
 * front, right, down; the law's front, left, up.
 */
#include "AC_CustomControl_config.h"

#if AP_CUSTOMCONTROL_ENABLED

#include "AC_CustomControl_Quadstep.h"

#include <AP_AHRS/AP_AHRS.h>
#include <AP_HAL/AP_HAL.h>
#include <AP_InertialSensor/AP_InertialSensor.h>
#include <AP_Logger/AP_Logger.h>
#include <cstring>

static const float GRAVITY = 9.80665f;
/* torque [N m] about roll, pitch, yaw of ArduPilot's mixer at an input of 1: half of each rotor's largest thrust, up or down */
static const float FULL[3] = {FULL_TORQUE};
static const uint32_t REFUSALS = 10u; /* rejected samples in a row, with the last output held, until ArduPilot takes over */
static const uint32_t LOG_EVERY = 4u; /* samples */
static const float LEAST_PERIOD = 0.0002f, MOST_PERIOD = 0.02f;

const AP_Param::GroupInfo AC_CustomControl_Quadstep::var_info[] = {
GAIN_TABLE
    AP_GROUPEND
};

AC_CustomControl_Quadstep::AC_CustomControl_Quadstep(AC_CustomControl &frontend, AP_AHRS_View *&ahrs,
        AC_AttitudeControl *&att_control, AP_MotorsMulticopter *&motors, float dt) :
    AC_CustomControl_Backend(frontend, ahrs, att_control, motors, dt),
    _params(NAME_mission), _refused(0u), _rejected(0u), _period(dt), _longest(0.0f), _last(0u), _ticks(0u), _status(0u), _started(false)
{
    AP_Param::setup_object_defaults(this, var_info);
    reset();
}

void AC_CustomControl_Quadstep::reset(void)
{
    NAME_reset(&_state);
    memset(&_made, 0, sizeof(_made));
    memset(_outer, 0, sizeof(_outer));
    _started = false;
    _ticks = 0u;
    _refused = _rejected = 0u;
}

void AC_CustomControl_Quadstep::take_gains(void)
{
GAIN_COPIES
}

Vector3f AC_CustomControl_Quadstep::update(void)
{
    NAME_measured measured;
    NAME_reference reference;
    NAME_command command;
    memset(&measured, 0, sizeof(measured));
    memset(&reference, 0, sizeof(reference));

    switch (_motors->get_spool_state()) {
    case AP_Motors::SpoolState::SHUT_DOWN:
    case AP_Motors::SpoolState::GROUND_IDLE:
        reset(); /* on the ground nothing is integrated */
        return Vector3f();
    default:
        break;
    }

    Quaternion attitude, wanted;
    _ahrs->get_quat_body_to_ned(attitude);
    wanted = _att_control->get_attitude_target_quat();
    const Vector3f turning = _att_control->get_attitude_target_ang_vel(); /* rad/s, of the wanted attitude in its own axes */
    const Vector3f gyro = _ahrs->get_gyro_latest();
    measured.attitude[0] = attitude.q1;
    measured.attitude[1] = attitude.q2;
    measured.attitude[2] = -attitude.q3;
    measured.attitude[3] = -attitude.q4;
    measured.rates[0] = gyro.x;
    measured.rates[1] = -gyro.y;
    measured.rates[2] = -gyro.z;
    measured.thrust = HOVER_THRUST; /* ArduPilot's own; the law is told that it hovers */
    if (!_started) { /* what ArduPilot's own controller commands at the switch */
        _made.torque[0] = _motors->get_roll() * FULL[0];
        _made.torque[1] = -_motors->get_pitch() * FULL[1];
        _made.torque[2] = -_motors->get_yaw() * FULL[2];
    }
    memcpy(measured.torque, _made.torque, sizeof(measured.torque));

    /* the columns of the wanted attitude, in axes z up, and how they turn */
    const float w = wanted.q1, x = wanted.q2, y = -wanted.q3, z = -wanted.q4;
    const float p = turning.x, q = -turning.y, r = -turning.z;
    const float ahead[3] = {1.0f - 2.0f * (y * y + z * z), 2.0f * (x * y + w * z), 2.0f * (x * z - w * y)};
    const float left[3] = {2.0f * (x * y - w * z), 1.0f - 2.0f * (x * x + z * z), 2.0f * (y * z + w * x)};
    const float up[3] = {2.0f * (x * z + w * y), 2.0f * (y * z - w * x), 1.0f - 2.0f * (x * x + y * y)};
    for (int i = 0; i < 3; ++i) {
        reference.acceleration[i] = GRAVITY * up[i];
        reference.jerk[i] = GRAVITY * (q * ahead[i] - p * left[i]);
    }
    reference.acceleration[2] -= GRAVITY;
    /* a law's heading is the level direction at right angles to the wanted left, which is not the Euler angle where both tilt */
    reference.yaw = atan2f(-left[0], left[1]);
    const float level = left[0] * left[0] + left[1] * left[1];
    if (level > 0.01f) { /* of an attitude on its side, the heading has no rate */
        reference.yaw_rate = (left[0] * (p * up[1] - r * ahead[1]) - left[1] * (p * up[0] - r * ahead[0])) / level;
    }

    NAME_clock clock;
    memset(&clock, 0, sizeof(clock));
    clock.tick = _ticks++;
    clock.step = _period;
    const uint32_t sampled = AP::ins().get_last_update_usec();
    const int32_t since = static_cast<int32_t>(sampled - _last); /* us; samples that repeat or go back count as usual */
    clock.period = (_started && since > 0) ? constrain_float(1e-6f * static_cast<float>(since), LEAST_PERIOD, MOST_PERIOD) : _period;
    _last = sampled;
    clock.age = 1e-6f * static_cast<float>(AP_HAL::micros() - sampled);
    take_gains();
    if (!_started) {
        /* the attitude that it has is the one that this torque keeps */
        NAME_reference present;
        memset(&present, 0, sizeof(present));
        const float a = attitude.q1, b = attitude.q2, c = -attitude.q3, d = -attitude.q4;
        present.acceleration[0] = GRAVITY * 2.0f * (b * d + a * c);
        present.acceleration[1] = GRAVITY * 2.0f * (c * d - a * b);
        present.acceleration[2] = -GRAVITY * 2.0f * (b * b + c * c);
        present.yaw = atan2f(2.0f * (a * d - b * c), 1.0f - 2.0f * (b * b + d * d));
        _started = NAME_enter(&_params, &_state, &measured, &present) == UPPER_OK;
    }
LOOPS
    _status = NAME_law(&_params, &_state, &measured, &reference, &clock, &command);
    _status |= OUTER_SUM;
    _refused = _status == UPPER_OK ? 0u : _refused + 1u;
    _rejected += _refused == 0u ? 0u : 1u;
    _status |= NAME_made(&_params, &command, &_made);
    if (_refused == 0u) {
        _mixed = Vector3f(constrain_float(_made.torque[0] / FULL[0], -1.0f, 1.0f),
                          constrain_float(-_made.torque[1] / FULL[1], -1.0f, 1.0f),
                          constrain_float(-_made.torque[2] / FULL[2], -1.0f, 1.0f));
    }
#if HAL_LOGGING_ENABLED
    _longest = fmaxf(_longest, clock.period);
    if (_ticks % LOG_EVERY == 0u) { /* torques in ArduPilot's axes [N m]: commanded, and of the mixer's inputs */
        AP::logger().WriteStreaming("QSTP", "TimeUS,Status,Rej,Dt,TX,TY,TZ,R,P,Y", "QIIfffffff", AP_HAL::micros64(), _status, _rejected,
                                    _longest, command.torque[0], -command.torque[1], -command.torque[2], _mixed.x, _mixed.y, _mixed.z);
        _longest = 0.0f;
    }
#endif
    if (_refused >= REFUSALS) { /* ArduPilot's own controller flies from the next sample on, until the switch is used again */
        _frontend.set_custom_controller(false);
    }
    return _mixed;
}

#endif  // AP_CUSTOMCONTROL_ENABLED
