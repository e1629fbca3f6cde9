/* Of ArduPilot's interface, what a back end of AC_CustomControl uses; written from its documentation for tests. */
#pragma once
#include <cmath>
#include <cstdint>
#include <cstring>
struct Vector3f {
    float x, y, z;
    Vector3f() : x(0), y(0), z(0) {}
    Vector3f(float a, float b, float c) : x(a), y(b), z(c) {}
};
struct Quaternion { float q1 = 1, q2 = 0, q3 = 0, q4 = 0; };
inline float constrain_float(float x, float low, float high) { return x < low ? low : (x > high ? high : x); }
#define AP_GROUPEND {}
struct AP_Param {
    struct GroupInfo {};
    static void setup_object_defaults(void *, const GroupInfo *) {}
};
struct AP_AHRS_View {
    Quaternion attitude; Vector3f gyro;
    void get_quat_body_to_ned(Quaternion &q) const { q = attitude; }
    Vector3f get_gyro_latest() const { return gyro; }
};
struct AC_AttitudeControl { Quaternion target; Quaternion get_attitude_target_quat() const { return target; } };
struct AP_MotorsMulticopter {};
struct AC_CustomControl {};
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
