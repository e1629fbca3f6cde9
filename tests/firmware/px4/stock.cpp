/* PX4's own loops over given samples, each lane a flight of its own: see tests/px4_stock.py. NED, and FRD axes. */
#include <string.h>
#define private public
#define protected public
#include <AttitudeControl.hpp>
#include <PositionControl/PositionControl.hpp>
#include <ControlAllocation/ControlAllocationSequentialDesaturation.hpp>
#include <lib/rate_control/rate_control.hpp>
#include <mathlib/math/filter/AlphaFilter.hpp>
#include <mathlib/math/filter/LowPassFilter2p.hpp>
#include <mathlib/math/filter/NotchFilter.hpp>

using namespace matrix;

extern "C" {

/* in: attitude, wanted one (w, x, y, z), rate of the heading. out: body rates. */
void attitude(int lanes, int samples, const float *in, float *out)
{
	AttitudeControl law;
	law.setProportionalGain(Vector3f(6.5f, 6.5f, 2.8f), 0.4f);
	law.setRateLimit(Vector3f(math::radians(220.f), math::radians(220.f), math::radians(200.f)));

	for (int i = 0; i < lanes * samples; i++, in += 9, out += 3) {
		law.setAttitudeSetpoint(Quatf(in + 4), in[8]);
		law.update(Quatf(in)).copyTo(out);
	}
}

/* in: rates, wanted ones, accelerations, what was missed (1, 0, -1). out: torques. */
void rates(int lanes, int samples, const float *in, float *out)
{
	for (int lane = 0; lane < lanes; lane++) {
		RateControl law;
		law.setPidGains(Vector3f(.15f, .15f, .2f), Vector3f(.2f, .2f, .1f), Vector3f(.003f, .003f, 0.f));
		law.setIntegratorLimit(Vector3f(.3f, .3f, .3f));
		law.setFeedForwardGain(Vector3f(.01f, 0.f, .02f));

		for (int i = 0; i < samples; i++, in += 12, out += 3) {
			for (int axis = 0; axis < 3; axis++) {
				law.setPositiveSaturationFlag(axis, in[9 + axis] > .5f);
				law.setNegativeSaturationFlag(axis, in[9 + axis] < -.5f);
			}

			law.update(Vector3f(in), Vector3f(in + 3), Vector3f(in + 6), .00125f, false).copyTo(out);
		}
	}
}

/* in: one axis of the gyro. out: its filtered rate and acceleration, with a notch at 100 Hz. */
void gyro(int lanes, int samples, const float *in, float *out)
{
	for (int lane = 0; lane < lanes; lane++) {
		math::NotchFilter<float> notch;
		math::LowPassFilter2p<float> smooth;
		AlphaFilter<float> slope;
		notch.setParameters(800.f, 100.f, 20.f);
		smooth.set_cutoff_frequency(800.f, 40.f);
		slope.setCutoffFreq(800.f, 30.f);
		smooth.reset(in[0]);
		float before = in[0];

		for (int i = 0; i < samples; i++, in++, out += 2) {
			out[0] = smooth.apply(notch.apply(in[0]));
			out[1] = slope.update((out[0] - before) * 800.f);
			before = out[0];
		}
	}
}

/* in: position, velocity, acceleration, wanted position, velocity, acceleration, heading. out: thrust, attitude. */
static void fly(int lanes, int samples, const float *in, float *out, bool decouple)
{
	for (int lane = 0; lane < lanes; lane++) {
		PositionControl law;
		law.setPositionGains(Vector3f(.95f, .95f, 1.f));
		law.setVelocityGains(Vector3f(1.8f, 1.8f, 4.f), Vector3f(.4f, .4f, 2.f), Vector3f(.2f, .2f, .1f));
		law.setVelocityLimits(12.f, 3.f, 1.5f);
		law.setThrustLimits(.12f, 1.f);
		law.setHorizontalThrustMargin(.3f);
		law.setTiltLimit(math::radians(45.f));
		law.setHoverThrust(.5f);
		law.decoupleHorizontalAndVecticalAcceleration(decouple);

		for (int i = 0; i < samples; i++, in += 19, out += 7) {
			trajectory_setpoint_s wanted = PositionControl::empty_trajectory_setpoint;
			PositionControlStates now{Vector3f(in), Vector3f(in + 3), Vector3f(in + 6), 0.f};
			vehicle_attitude_setpoint_s attitude{};
			memcpy(wanted.position, in + 9, 12);
			memcpy(wanted.velocity, in + 12, 12);
			memcpy(wanted.acceleration, in + 15, 12);
			wanted.yaw = in[18];
			law.setState(now);
			law.setInputSetpoint(wanted);
			law.update(.01f);
			law.getAttitudeSetpoint(attitude);
			law._thr_sp.copyTo(out);
			memcpy(out + 3, attitude.q_d, 16);
		}
	}
}

void position(int lanes, int samples, const float *in, float *out) { fly(lanes, samples, in, out, true); }
void coupled(int lanes, int samples, const float *in, float *out) { fly(lanes, samples, in, out, false); }

/* in: torques, thrust. out: outputs of an X500's motors, and the torques that they do not make. */
static void mix(int lanes, int samples, const float *in, float *out, int airmode)
{
	static const float arm = .17678f, place[4][3] = {{arm, arm, .016f}, {-arm, -arm, .016f}, {arm, -arm, -.016f}, {-arm, arm, -.016f}};
	ControlAllocationSequentialDesaturation law;
	Matrix<float, 6, 16> effects;
	Vector<float, 16> none;

	for (int i = 0; i < 4; i++) { /* as ActuatorEffectivenessRotors does */
		Vector3f up(0.f, 0.f, -1.f), lift = 6.5f * up;
		Vector3f moment = 6.5f * Vector3f(place[i][0], place[i][1], 0.f).cross(up) - 6.5f * place[i][2] * up;

		for (int j = 0; j < 3; j++) {
			effects(j, i) = moment(j);
			effects(j + 3, i) = lift(j);
		}
	}

	law.setNormalizeRPY(true);
	law.setEffectivenessMatrix(effects, none, none, 4, true);
	law._param_mc_airmode.value = airmode;

	for (int i = 0; i < lanes * samples; i++, in += 4, out += 7) {
		Vector<float, 6> wanted;
		wanted(0) = in[0]; wanted(1) = in[1]; wanted(2) = in[2]; wanted(5) = -in[3];
		law.setControlSetpoint(wanted);
		law.allocate();
		law.clipActuatorSetpoint();
		Vector<float, 6> missed = law.getControlSetpoint() - law.getAllocatedControl();

		for (int j = 0; j < 4; j++) { out[j] = law.getActuatorSetpoint()(j); }
		for (int j = 0; j < 3; j++) { out[4 + j] = missed(j); }
	}
}

void mixer(int lanes, int samples, const float *in, float *out) { mix(lanes, samples, in, out, 0); }
void airmode1(int lanes, int samples, const float *in, float *out) { mix(lanes, samples, in, out, 1); }
void airmode2(int lanes, int samples, const float *in, float *out) { mix(lanes, samples, in, out, 2); }

}
