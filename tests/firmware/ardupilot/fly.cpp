/* What the back end gives to the mixer for a few attitudes and wanted attitudes (roll, pitch, yaw; front, right, down). */
#include <cstdio>
#include "AC_CustomControl_Quadstep.h"
#include <AP_HAL/AP_HAL.h>
#include <AP_InertialSensor/AP_InertialSensor.h>
#include <AP_Logger/AP_Logger.h>
static Quaternion turned(float roll, float pitch, float yaw)
{
    const float a = cosf(roll / 2), b = sinf(roll / 2), c = cosf(pitch / 2), d = sinf(pitch / 2), e = cosf(yaw / 2), f = sinf(yaw / 2);
    Quaternion q;
    q.q1 = a * c * e + b * d * f; q.q2 = b * c * e - a * d * f; q.q3 = a * d * e + b * c * f; q.q4 = a * c * f - b * d * e;
    return q;
}
int main()
{
    AP_AHRS_View view; AC_AttitudeControl control; AP_MotorsMulticopter motor; AC_CustomControl front;
    AP_AHRS_View *ahrs = &view; AC_AttitudeControl *attitude = &control; AP_MotorsMulticopter *motors = &motor;
    const float wanted[][3] = {{0, 0, 0}, {0.1f, 0, 0}, {0, 0.1f, 0}, {0, 0, 0.1f}};
    for (const auto &one : wanted) {
        AC_CustomControl_Quadstep law(front, ahrs, attitude, motors, 0.0025f);
        view.attitude = turned(0, 0, 0);
        control.target = turned(one[0], one[1], one[2]);
        const Vector3f mixed = law.update();
        std::printf("%.6f %.6f %.6f\n", mixed.x, mixed.y, mixed.z);
    }
    for (int axis = 0; axis < 3; ++axis) { /* at the wanted attitude, tilted and turned, which turns about one axis, and still */
        control.target = view.attitude = turned(0.2f, -0.3f, 0.9f);
        control.turning = Vector3f(axis == 0 ? 0.5f : 0.0f, axis == 1 ? 0.5f : 0.0f, axis == 2 ? 0.5f : 0.0f);
        AC_CustomControl_Quadstep law(front, ahrs, attitude, motors, 0.0025f);
        const Vector3f mixed = law.update();
        std::printf("turning %d %.6f %.6f %.6f\n", axis, mixed.x, mixed.y, mixed.z);
        control.turning = view.gyro = Vector3f();
    }
    view.attitude = turned(0, 0, 0);
    AC_CustomControl_Quadstep law(front, ahrs, attitude, motors, 0.0025f);
    const auto say = [&](const char *word) { const Vector3f mixed = law.update(); std::printf("%s %.6f %.6f %.6f %d\n", word, mixed.x, mixed.y, mixed.z, front.left); };
    control.target = turned(0.1f, 0, 0);
    motor.spool = AP_Motors::SpoolState::GROUND_IDLE;
    for (int i = 0; i < 400; ++i) { (void)law.update(); }
    say("idle");
    motor.spool = AP_Motors::SpoolState::SPOOLING_UP;
    say("flown"); /* nothing was integrated */
    AP_HAL::stub_time() += 90000;
    for (int i = 0; i < 12; ++i) { (void)law.update(); }
    say("young");
    AP_HAL::stub_time() += 20000; /* the gyro was read 0.11 s ago */
    say("refused");
    for (int i = 0; i < 8; ++i) { (void)law.update(); }
    say("left");
    AP::ins().last = AP_HAL::micros(); front.left = 0; law.reset(); /* as the switch does */
    say("back");
    for (int what = 0; what < 3; ++what) {
        view.gyro.y = what == 0 ? NAN : 0.0f; view.attitude = turned(0, 0, 0);
        view.attitude.q1 = what == 1 ? INFINITY : view.attitude.q1;
        control.target = turned(0.1f, 0, 0); control.target.q2 = what == 2 ? NAN : control.target.q2;
        front.left = 0; law.reset();
        for (int i = 0; i < 20; ++i) { (void)law.update(); } /* the loop that reads it is due every so many samples */
        say("left");
    }
    view.attitude = turned(0, 0, 0); view.gyro.y = 0.0f;
    control.target = turned(1.5f, 0, 0); view.gyro.x = -50.0f; law.reset();
    for (int i = 0; i < 20; ++i) { (void)law.update(); }
    say("saturated");
    int found = 0;
    for (const AP_Param::GroupInfo *one = AC_CustomControl_Quadstep::var_info; one->name; ++one) {
        if (std::strcmp(one->name, "RAT_X") != 0) { continue; }
        ++found; reinterpret_cast<AP_Float *>(reinterpret_cast<char *>(&law) + one->offset)->value *= 0.5f;
    }
    view.gyro.x = 0.0f; control.target = turned(0.1f, 0, 0); law.reset();
    std::printf("halved %d ", found); say("");
    const int late[] = {2500, 5000, 0, -500, 30000, 100};
    for (const int since : late) { /* us from one sample of the gyro to the next */
        for (int i = 0; i < 8; ++i) { AP_HAL::stub_time() += 2500; AP::ins().last += since; (void)law.update(); }
        std::printf("since %.9g\n", AP::logger().last.at(3));
    }
    AP::ins().last = AP_HAL::micros(); law.reset();
    for (int i = 0; i < 4; ++i) { view.gyro.y = (i == 1 || i == 2) ? NAN : 0.0f; (void)law.update(); }
    std::printf("logged");
    for (const double one : AP::logger().last) { std::printf(" %.9g", one); }
    std::printf("\n");
    view.attitude = control.target = turned(0.1f, -0.15f, 0.9f);
    motor.roll = 0.05f; motor.pitch = -0.04f; motor.yaw = 0.06f; law.reset();
    say("enters");
    return 0;
}
