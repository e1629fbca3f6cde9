/*
 * TITLE as a back end of ArduPilot's AC_CustomControl.
 *
 * A back end returns what goes to the mixer for roll, pitch and yaw; thrust and position stay ArduPilot's. So the law is told
 * that it is on its path, and asked for the acceleration whose thrust points where ArduPilot wants it: the attitude that the
 * law then wants is ArduPilot's. ArduPilot's body axes are front, right, down; the law's front, left, up.
 */
#include "AC_CustomControl_Quadstep.h"

#include <AP_AHRS/AP_AHRS.h>
#include <AP_HAL/AP_HAL.h>
#include <AP_InertialSensor/AP_InertialSensor.h>
#include <cstring>

static const float GRAVITY = 9.80665f;
/* torque at full differential about roll, pitch, yaw [N m], at the thrust of hovering */
static const float FULL[3] = {FULL_TORQUE};

const AP_Param::GroupInfo AC_CustomControl_Quadstep::var_info[] = {AP_GROUPEND};

AC_CustomControl_Quadstep::AC_CustomControl_Quadstep(AC_CustomControl &frontend, AP_AHRS_View *&ahrs,
        AC_AttitudeControl *&att_control, AP_MotorsMulticopter *&motors, float dt) :
    AC_CustomControl_Backend(frontend, ahrs, att_control, motors, dt),
    _period(dt), _ticks(0u), _status(0u), _started(false)
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
}

Vector3f AC_CustomControl_Quadstep::update(void)
{
    NAME_measured measured;
    NAME_reference reference;
    NAME_command command;
    memset(&measured, 0, sizeof(measured));
    memset(&reference, 0, sizeof(reference));

    Quaternion attitude, wanted;
    _ahrs->get_quat_body_to_ned(attitude);
    wanted = _att_control->get_attitude_target_quat();
    const Vector3f gyro = _ahrs->get_gyro_latest();
    measured.attitude[0] = attitude.q1;
    measured.attitude[1] = attitude.q2;
    measured.attitude[2] = -attitude.q3;
    measured.attitude[3] = -attitude.q4;
    measured.rates[0] = gyro.x;
    measured.rates[1] = -gyro.y;
    measured.rates[2] = -gyro.z;
    measured.thrust = HOVER_THRUST; /* ArduPilot's own; the law is told that it hovers */
    memcpy(measured.torque, _made.torque, sizeof(measured.torque));

    /* the third axis and the heading of the wanted attitude, in axes z up */
    const float w = wanted.q1, x = wanted.q2, y = -wanted.q3, z = -wanted.q4;
    reference.acceleration[0] = GRAVITY * 2.0f * (x * z + w * y);
    reference.acceleration[1] = GRAVITY * 2.0f * (y * z - w * x);
    reference.acceleration[2] = GRAVITY * (1.0f - 2.0f * (x * x + y * y)) - GRAVITY;
    reference.yaw = atan2f(2.0f * (x * y + w * z), 1.0f - 2.0f * (y * y + z * z));

    NAME_clock clock;
    memset(&clock, 0, sizeof(clock));
    clock.tick = _ticks++;
    clock.step = _period;
    clock.period = _period;
    const uint32_t sampled = AP::ins().get_last_update_usec();
    clock.age = 1e-6f * static_cast<float>(AP_HAL::micros() - sampled);
    if (!_started) {
        _started = NAME_start(&NAME_mission, &_state, &measured) == UPPER_OK;
    }
LOOPS
    _status = NAME_law(&NAME_mission, &_state, &measured, &reference, &clock, &command);
    _status |= OUTER_SUM;
    const bool refused = _status != UPPER_OK;
    _status |= NAME_made(&NAME_mission, &command, &_made);
    if (refused) {
        return Vector3f(); /* no torque; switch back to ArduPilot's own controller */
    }

    Vector3f mixed(_made.torque[0] / FULL[0], -_made.torque[1] / FULL[1], -_made.torque[2] / FULL[2]);
    mixed.x = constrain_float(mixed.x, -1.0f, 1.0f);
    mixed.y = constrain_float(mixed.y, -1.0f, 1.0f);
    mixed.z = constrain_float(mixed.z, -1.0f, 1.0f);
    return mixed;
}
