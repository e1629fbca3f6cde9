/* Of ArduPilot's interface, what a back end of AC_CustomControl uses; written from its documentation for tests. */
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
struct Vector3f {
    float x, y, z;
    Vector3f() : x(0), y(0), z(0) {}
    Vector3f(float a, float b, float c) : x(a), y(b), z(c) {}
};
struct Quaternion { float q1 = 1, q2 = 0, q3 = 0, q4 = 0; };
inline float constrain_float(float x, float low, float high) { return x < low ? low : (x > high ? high : x); }
struct AP_Float { float value; float get() const { return value; } };
struct AP_Param {
    struct GroupInfo { const char *name; int index; long offset; float value; };
    static void setup_object_defaults(void *object, const GroupInfo *group)
    {
        for (; group->name; ++group) { reinterpret_cast<AP_Float *>(static_cast<char *>(object) + group->offset)->value = group->value; }
    }
};
#define AP_GROUPINFO(name, index, clazz, element, value) {name, index, ((ptrdiff_t)&(((const clazz *)1)->element) - 1), value}
#define AP_GROUPEND {nullptr, 0, 0, 0}
struct AP_Motors { enum class SpoolState : uint8_t { SHUT_DOWN, GROUND_IDLE, SPOOLING_UP, THROTTLE_UNLIMITED, SPOOLING_DOWN }; };
struct AP_AHRS_View {
    Quaternion attitude; Vector3f gyro;
    void get_quat_body_to_ned(Quaternion &q) const { q = attitude; }
    Vector3f get_gyro_latest() const { return gyro; }
};
struct AC_AttitudeControl {
    Quaternion target; Vector3f turning;
    Quaternion get_attitude_target_quat() const { return target; }
    const Vector3f &get_attitude_target_ang_vel() const { return turning; }
};
struct AP_MotorsMulticopter : AP_Motors {
    SpoolState spool = SpoolState::THROTTLE_UNLIMITED;
    SpoolState get_spool_state() const { return spool; }
    float roll = 0.0f, pitch = 0.0f, yaw = 0.0f;
    float get_roll() const { return roll; }
    float get_pitch() const { return pitch; }
    float get_yaw() const { return yaw; }
};
struct AC_CustomControl { int left = 0; void set_custom_controller(bool on) { left += !on; } };
class AC_CustomControl_Backend
{
public:
    AC_CustomControl_Backend(AC_CustomControl &frontend, AP_AHRS_View *&ahrs, AC_AttitudeControl *&att_control, AP_MotorsMulticopter *&motors, float)
        : _ahrs(ahrs), _att_control(att_control), _motors(motors), _frontend(frontend) {}
    virtual ~AC_CustomControl_Backend() = default;
    virtual Vector3f update() = 0;
    virtual void reset() = 0;
protected:
    AP_AHRS_View *&_ahrs;
    AC_AttitudeControl *&_att_control;
    AP_MotorsMulticopter *&_motors;
    AC_CustomControl &_frontend;
};
