/* ArduPilot's own loops over given samples, each lane a flight of its own: see tests/ardupilot_stock.py. */
#include <AC_AttitudeControl/AC_AttitudeControl_Multi.h>
#include <AC_AttitudeControl/AC_PosControl.h>
#include <new>

static AP_HAL::HAL none;
const AP_HAL::HAL &hal = none;

extern "C" {

/* in: target, measured, whether at a limit. out: output and feed-forward. */
static void run(AC_PID &law, int samples, const float *in, float *out)
{
    for (int i = 0; i < samples; i++, in += 3, out += 2) {
        out[0] = law.update_all(in[0], in[1], 0.0025f, in[2] > 0.5f);
        out[1] = law.get_ff();
    }
}

static void with(AC_PID &law, float p, float i, float d, float ff, float imax, float t, float e, float f, float dff, float pdmax)
{
    law.set_kP(p); law.set_kI(i); law.set_kD(d); law.set_ff(ff); law.set_imax(imax);
    law.set_filt_T_hz(t); law.set_filt_E_hz(e); law.set_filt_D_hz(f); law.set_kDff(dff); law.set_pdmax(pdmax);
}

void rates(int lanes, int samples, const float *in, float *out)
{
    for (int lane = 0; lane < lanes; lane++) {
        AC_PID law(0, 0, 0, 0, 0, 0, 0, 0);
        law.reset_I();
        with(law, 0.135f, 0.135f, 0.0036f, 0.0f, 0.5f, 20.0f, 0.0f, 20.0f, 0.0f, 0.0f);
        run(law, samples, in + 3 * lane * samples, out + 2 * lane * samples);
    }
}

void all(int lanes, int samples, const float *in, float *out)
{
    for (int lane = 0; lane < lanes; lane++) {
        AC_PID law(0, 0, 0, 0, 0, 0, 0, 0);
        law.reset_I();
        with(law, 0.18f, 0.018f, 0.002f, 0.1f, 0.05f, 20.0f, 2.5f, 10.0f, 0.01f, 0.2f);
        run(law, samples, in + 3 * lane * samples, out + 2 * lane * samples);
    }
}

/* in: target, measured, whether at a lower and an upper limit. out: output. */
void climb(int lanes, int samples, const float *in, float *out)
{
    for (int lane = 0; lane < lanes; lane++) {
        AC_PID_Basic law(5.0f, 0.5f, 0.1f, 0.2f, 1000.0f, 5.0f, 5.0f);
        law._kp.set(5.0f); law._ki.set(0.5f); law._kd.set(0.1f); law._kff.set(0.2f);
        law._kimax.set(10.0f); law._filt_E_hz.set(5.0f); law._filt_D_hz.set(5.0f);
        law.reset_I();

        for (int i = 0; i < samples; i++, in += 4, out++) {
            out[0] = law.update_all(in[0], in[1], 0.0025f, in[2] > 0.5f, in[3] > 0.5f);
        }
    }
}

/* in: error, rate, wanted rate. out: square-root controller, its inverse, shaped rate. */
void shapes(int lanes, int samples, const float *in, float *out)
{
    for (int i = 0; i < lanes * samples; i++, in += 3, out += 3) {
        out[0] = sqrt_controller(in[0], 4.5f, 9.6f, 0.0025f);
        out[1] = inv_sqrt_controller(fabsf(in[1]), 4.5f, 2.1f);
        out[2] = AC_AttitudeControl::input_shaping_angle(in[0], 0.15f, 4.7f, in[1], in[2], 1.05f, 0.0025f);
    }
}

/* in: torques, throttle, average. out: thrusts of four rotors, limits of roll, yaw, throttle up and down. */
void mixer(int lanes, int samples, const float *in, float *out)
{
    AP_MotorsMatrix law;

    for (int i = 0; i < lanes * samples; i++, in += 5, out += 8) {
        law._roll_in = in[0]; law._pitch_in = in[1]; law._yaw_in = in[2];
        law.throttle = in[3]; law._throttle_avg_max = in[4];
        law.limit = {};
        law.output_armed_stabilizing();

        for (int j = 0; j < 4; j++) { out[j] = law._thrust_rpyt_out[j]; }
        out[4] = law.limit.roll; out[5] = law.limit.yaw; out[6] = law.limit.throttle_upper; out[7] = law.limit.throttle_lower;
    }
}

/* in, in axes of forward, left, up: position, wanted; velocity, wanted; acceleration wanted; heading, its rate; attitude; rates;
   vertical acceleration; throttle at its lower and its upper limit. out: rates wanted, throttle, its average, limit of the
   lean, integral of the horizontal velocity. Throttle before attitude, as a mode of Copter has it. */
static void fly(bool limited, int lanes, int samples, const float *in, float *out)
{
    for (int lane = 0; lane < lanes; lane++) {
        AP_AHRS_View ahrs;
        AP_MultiCopter copter;
        AP_MotorsMulticopter motors {};
        alignas(16) static char rooms[2][sizeof(AC_AttitudeControl_Multi) + sizeof(AC_PosControl)];
        memset(rooms, 0, sizeof(rooms)); /* ArduPilot's memory is 0 before an object is made in it */
        AC_AttitudeControl_Multi &attitude = *new (rooms[0]) AC_AttitudeControl_Multi(ahrs, copter, motors);
        AC_PosControl &position = *new (rooms[1]) AC_PosControl(ahrs, motors, attitude);
        position._lean_angle_max_deg.set(limited ? 15 : 0);
        if (limited) {
            attitude._ang_vel_roll_max_degs.set(60); attitude._ang_vel_pitch_max_degs.set(40); attitude._ang_vel_yaw_max_degs.set(30);
            attitude._accel_roll_max_cdss.set(20000); attitude._accel_pitch_max_cdss.set(15000); attitude._accel_yaw_max_cdss.set(4000);
        }
        attitude.set_dt_s(0.0025f); position.set_dt_s(0.0025f);
        position.set_correction_speed_accel_NE_m(10, 2.5f); position.set_correction_speed_accel_U_mss(1.5f, 2.5f, 1);
        attitude._throttle_in = motors.hover;
        attitude._althold_lean_angle_max_rad = radians(30);

        for (int i = 0; i < samples; i++, in += 27, out += 8) {
            ahrs.attitude = Quaternion(in[17], in[18], -in[19], -in[20]); ahrs.attitude.normalize();
            ahrs.gyro = Vector3f(in[21], -in[22], -in[23]);
            attitude._rate_gyro_rads = ahrs.gyro;
            position._pos_estimate_neu_m = Vector3p(in[0], -in[1], in[2]);
            position._vel_estimate_neu_ms = Vector3f(in[6], -in[7], in[8]);
            motors.limit.throttle_lower = in[25] > 0.5f; motors.limit.throttle_upper = in[26] > 0.5f;

            if (i == 0) {
                ahrs.acceleration = Vector3f(0, 0, -GRAVITY_MSS);
                attitude._attitude_target = ahrs.attitude;
                attitude._thrust_angle_rad = acosf(-(ahrs.attitude * Vector3f(0, 0, -1)).z);
                position.init_NE_controller(); position.init_U_controller();
            }
            ahrs.acceleration = Vector3f(0, 0, -GRAVITY_MSS - in[24]);
            position.set_pos_vel_accel_NEU_m(Vector3p(in[3], -in[4], in[5]), Vector3f(in[9], -in[10], in[11]), Vector3f(in[12], -in[13], in[14]));
            position.update_NE_controller();
            position.update_U_controller();
            attitude.input_thrust_vector_heading_rad(position.get_thrust_vector(), -in[15], -in[16]);
            const Vector3f &rates = attitude._ang_vel_body_rads;
            const Vector2f &integral = position._pid_vel_ne_cm.get_i();
            const float found[] = {
                rates.x, -rates.y, -rates.z, motors.throttle, motors._throttle_avg_max, attitude.get_althold_lean_angle_max_rad(),
                0.01f * integral.x, -0.01f * integral.y
            };
            memcpy(out, found, sizeof(found));
        }
    }
}

void cascade(int lanes, int samples, const float *in, float *out) { fly(false, lanes, samples, in, out); }
void limited(int lanes, int samples, const float *in, float *out) { fly(true, lanes, samples, in, out); }

}
