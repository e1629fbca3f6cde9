/* What the back end gives to the mixer for a few attitudes and wanted attitudes (roll, pitch, yaw; front, right, down). */
#include <cstdio>
#include "AC_CustomControl_Quadstep.h"
#include <AP_HAL/AP_HAL.h>
#include <AP_InertialSensor/AP_InertialSensor.h>
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
    AC_CustomControl_Quadstep law(front, ahrs, attitude, motors, 0.0025f);
    const auto say = [&](const char *word) { const Vector3f mixed = law.update(); std::printf("%s %.6f %.6f %.6f\n", word, mixed.x, mixed.y, mixed.z); };
    control.target = turned(0.1f, 0, 0);
    say("flown");
    AP_HAL::stub_time() += 90000;
    say("young");
    AP_HAL::stub_time() += 20000; /* the gyro was read 0.11 s ago */
    say("refused");
    AP::ins().last = AP_HAL::micros();
    say("back");
    view.gyro.y = NAN;
    say("refused");
    view.gyro.y = 0.0f; view.attitude.q1 = INFINITY;
    say("refused");
    view.attitude = turned(0, 0, 0); control.target.q2 = NAN;
    for (int i = 0; i < 20; ++i) { (void)law.update(); } /* the loop that reads it is due every so many samples */
    say("refused");
    control.target = turned(1.5f, 0, 0); view.gyro.x = -50.0f;
    for (int i = 0; i < 20; ++i) { (void)law.update(); }
    say("saturated");
    return 0;
}
