/* ArduPilot's own loops over given samples, each lane a flight of its own: see tests/ardupilot_stock.py. */
#include <AC_PID/AC_PID.h>
#include <AC_PID/AC_PID_Basic.h>
#include <AP_Math/AP_Math.h>
#include <AP_Motors/AP_Motors.h>

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
        out[2] = input_shaping_angle(in[0], 0.15f, 4.7f, in[1], in[2], 1.05f, 0.0025f);
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

}
