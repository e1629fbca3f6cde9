/* Registers, switches to the mode, and flies golden samples through the module; prints motor outputs beside the law's speeds. */
#include <cstdio>
#include "QuadstepControl.hpp"
#include <uORB/topics/debug_array.h>
#include <parameters/param.h>
#include "NAME_golden.h"
extern "C" int quadstep_control_main(int argc, char *argv[]);
template<typename T> void tell(topic_t topic, const T &message) { uORB::Publication<T>(topic).publish(message); }
template<typename T> T heard(topic_t topic) { T message{}; uORB::Subscription(topic).copy(&message); return message; }
static vehicle_attitude_s attitude{};
static vehicle_local_position_s position{};
static vehicle_angular_velocity_s rates{};
static trajectory_setpoint_s setpoint{};
static arming_check_request_s check{};
static px4::WorkItem *module;
static int since = 2000; /* us, from one sample of the gyro to the next */
static bool asks = true; /* PX4 asks at every sample whether the mode can run */
/* One sample of the gyro. fresh: the position is new; ahead: how much later than the gyro's sample it says it is [us]. */
static void step(bool fresh, vehicle_local_position_s place, vehicle_angular_velocity_s turning, int ahead = 0)
{
	stub_time() += since;
	if (fresh) { place.timestamp = place.timestamp_sample = stub_time() + ahead; position.timestamp = position.timestamp_sample = place.timestamp; }
	vehicle_attitude_s level = attitude; level.timestamp = level.timestamp_sample = stub_time();
	turning.timestamp_sample = stub_time();
	tell(ORB_ID(vehicle_attitude), level); tell(ORB_ID(vehicle_local_position), place); tell(ORB_ID(vehicle_angular_velocity), turning);
	if (asks) { check.request_id++; tell(ORB_ID(arming_check_request), check); }
	module->Run();
}
static void say(const char *word, int what)
{
	const actuator_motors_s motors = heard<actuator_motors_s>(ORB_ID(actuator_motors));
	const arming_check_reply_s reply = heard<arming_check_reply_s>(ORB_ID(arming_check_reply));
	std::printf("%s %d %d %.7g %.7g %.7g %.7g\n", word, what, reply.can_arm_and_run, motors.control[0], motors.control[1], motors.control[2], motors.control[3]);
}
static void ask(const float *where, const float *speed, float yaw)
{
	for (int k = 0; k < 3; ++k) { setpoint.position[k] = where[k]; setpoint.velocity[k] = speed[k]; setpoint.acceleration[k] = setpoint.jerk[k] = 0.0f; }
	setpoint.yaw = yaw; setpoint.yawspeed = 0.0f; setpoint.timestamp = stub_time() + 1000;
	tell(ORB_ID(trajectory_setpoint), setpoint);
}
static void select_mode(uint8_t mode, uint8_t intended, bool armed = true)
{
	vehicle_status_s status{}; status.nav_state = mode; status.nav_state_user_intention = intended;
	status.arming_state = armed ? vehicle_status_s::ARMING_STATE_ARMED : 1;
	tell(ORB_ID(vehicle_status), status);
}
/* At rest, level: the sum of the outputs follows the height's error, differences the others. */
static void settle(int samples) { for (int i = 0; i < samples; ++i) { step(true, position, rates); } }
int main()
{
	quadstep_control_main(0, nullptr);
	module = QuadstepControl::instance();
	module->Run();
	std::printf("asked for %s\n", heard<register_ext_component_request_s>(ORB_ID(register_ext_component_request)).name);
	register_ext_component_reply_s reply{};
	reply.request_id = 42; reply.success = true; reply.mode_id = 23; reply.arming_check_id = 1;
	tell(ORB_ID(register_ext_component_reply), reply);
	check.request_id = 7;
	tell(ORB_ID(arming_check_request), check);
	module->Run();
	std::printf("checked %d %d\n", heard<arming_check_reply_s>(ORB_ID(arming_check_reply)).request_id, heard<arming_check_reply_s>(ORB_ID(arming_check_reply)).can_arm_and_run);
	NAME_state law; NAME_measured measured; NAME_reference reference; NAME_command command{}; NAME_actuators made{};
	command.thrust = 1e9f;
	NAME_made(&NAME_mission, &command, &made);
	const float fastest = made.speeds[0];
	command.thrust = 25.0f; command.torque[0] = 0.2f; command.torque[1] = -0.3f; command.torque[2] = 0.05f;
	NAME_made(&NAME_mission, &command, &made);
	actuator_motors_s last{}; /* of PX4's own mixer, for this command */
	for (int k = 0; k < 4; ++k) { last.control[k] = made.speeds[k] * made.speeds[k] / (fastest * fastest); }
	tell(ORB_ID(actuator_motors), last);
	select_mode(23, 23);
	NAME_params gains = NAME_mission;
	for (unsigned i = 0; i < 13; ++i) {
		if (i == 6) { /* a gain is changed, and two to what they may not be */
			gains.gains.rate[0] *= 1.5f;
			parameters()["QS_RAT_X"] = gains.gains.rate[0];
			parameters()["QS_RAT_Y"] = -1.0f; parameters()["QS_POS_X"] = NAN;
			tell(ORB_ID(parameter_update), parameter_update_s{});
		}
		std::memcpy(&measured, golden_measured[i], sizeof measured);
		std::memcpy(&reference, golden_reference[i], sizeof reference);
		std::memset(reference.snap, 0, sizeof reference.snap);
		measured.thrust = made.thrust; std::memcpy(measured.torque, made.torque, sizeof made.torque);
		const float sign[3] = {1.0f, -1.0f, -1.0f};
		for (int k = 0; k < 3; ++k) {
			rates.xyz[k] = sign[k] * measured.rates[k];
			setpoint.position[k] = sign[k] * reference.position[k]; setpoint.velocity[k] = sign[k] * reference.velocity[k];
			setpoint.acceleration[k] = sign[k] * reference.acceleration[k]; setpoint.jerk[k] = sign[k] * reference.jerk[k];
			attitude.q[k + 1] = sign[k] * measured.attitude[k + 1];
		}
		attitude.q[0] = measured.attitude[0];
		position.x = measured.position[0]; position.y = -measured.position[1]; position.z = -measured.position[2];
		position.vx = measured.velocity[0]; position.vy = -measured.velocity[1]; position.vz = -measured.velocity[2];
		position.xy_valid = position.z_valid = position.v_xy_valid = position.v_z_valid = true;
		setpoint.yaw = -reference.yaw; setpoint.yawspeed = -reference.yaw_rate; setpoint.timestamp = stub_time() + 1000;
		if (i > 0) { tell(ORB_ID(trajectory_setpoint), setpoint); }
		const int late[13] = {2000, 2000, 2000, 4000, 2000, 0, 2000, -500, 2000, 2000, 30000, 2000, 2000};
		since = late[i];
		step(true, position, rates, 700);
		since = 2000;
		if (i == 0) {
			const float *q = measured.attitude;
			reference = NAME_reference{}; /* the present motion */
			std::memcpy(reference.position, measured.position, sizeof reference.position);
			std::memcpy(reference.velocity, measured.velocity, sizeof reference.velocity);
			reference.yaw = std::atan2(2.0f * (q[0] * q[3] - q[1] * q[2]), 1.0f - 2.0f * (q[1] * q[1] + q[3] * q[3]));
			NAME_enter(&gains, &law, &measured, &reference);
			const actuator_motors_s motors = heard<actuator_motors_s>(ORB_ID(actuator_motors));
			std::printf("entry %d", motors.timestamp_sample == stub_time());
			for (int k = 0; k < 4; ++k) { std::printf(" %.7g", motors.control[k] - last.control[k]); }
			std::printf("\n");
			continue;
		}
		NAME_clock clock{}; clock.tick = i; clock.step = 0.002f;
		clock.period = late[i] <= 0 ? 0.002f : std::fmin(1e-6f * static_cast<float>(late[i]), 0.02f);
		if ((i - 1u) % 5u == 0u) { NAME_clock slow = clock; slow.period = 5.0f * clock.period; NAME_guide(&gains, &law, &measured, &reference, &slow); }
		NAME_law(&gains, &law, &measured, &reference, &clock, &command);
		NAME_made(&NAME_mission, &command, &made);
		const actuator_motors_s motors = heard<actuator_motors_s>(ORB_ID(actuator_motors));
		std::printf("sample %.7g %.7g %.7g %.7g", motors.control[0], motors.control[1], motors.control[2], motors.control[3]);
		for (float speed : made.speeds) { std::printf(" %.7g", speed); }
		std::printf("\n");
		const debug_array_s said = heard<debug_array_s>(ORB_ID(debug_array));
		if (said.timestamp != stub_time() || late[i] == 0) { continue; } /* not at every sample */
		std::printf("logged %d %.7g %.7g %.7g %.7g", said.id, said.data[0], said.data[1], said.data[2], said.data[3]);
		const float told[] = {-reference.yaw, command.thrust, made.thrust, command.torque[0], -command.torque[1], -command.torque[2], made.torque[0],
			-made.torque[1], -made.torque[2], reference.position[0], -reference.position[1], -reference.position[2], law.memory.outer.integral[0]};
		for (int k = 0; k < 13; ++k) { std::printf(" %.7g", said.data[4 + k] - told[k]); }
		std::printf("\n");
	}
	/* rejected input: old, not valid, not finite: position; not finite: a rate */
	for (int what = 0; what < 4; ++what) {
		vehicle_local_position_s place = position; vehicle_angular_velocity_s turning = rates;
		if (what == 1) { place.z_valid = false; }
		if (what == 2) { place.vy = NAN; }
		if (what == 3) { turning.xyz[2] = INFINITY; }
		asks = false;
		for (int i = 0; i < (what == 0 ? 49 : 9); ++i) { step(what != 0, place, turning); }
		say("young", what);
		for (int i = 0; i < (what == 0 ? 12 : 5); ++i) { step(what != 0, place, turning); }
		say("told", what); /* unasked */
		asks = true;
		for (int i = 0; i < 500; ++i) { step(what != 0, place, turning); }
		say("lost", what);
		select_mode(4, 23); settle(10);
		say("latched", what); /* PX4 flies; the pilot has not chosen another mode yet */
		select_mode(4, 4); settle(2);
		say("able", what);
		select_mode(23, 23); settle(10);
		say("back", what);
	}
	/* a vehicle at rest 5 m up that is 1.5 m from where it was last asked to be */
	attitude.q[0] = 1.0f; attitude.q[1] = attitude.q[2] = attitude.q[3] = 0.0f;
	rates = {}; position.vx = position.vy = position.vz = 0.0f; position.x = position.y = 0.0f; position.z = -5.0f;
	const float here[3] = {0.0f, 0.0f, -5.0f}, above[3] = {0.0f, 0.0f, -6.5f}, still[3] = {0.0f, 0.0f, 0.0f}, none[3] = {NAN, NAN, NAN};
	const float down[3] = {0.0f, 0.0f, 2.0f};
	select_mode(4, 4); settle(2);
	ask(above, still, 0.0f); /* before the entry */
	command = NAME_command{}; command.thrust = NAME_mission.gains.outer.mass * NAME_mission.gains.outer.gravity;
	NAME_made(&NAME_mission, &command, &made);
	for (int k = 0; k < 4; ++k) { last.control[k] = made.speeds[k] * made.speeds[k] / (fastest * fastest); }
	settle(2);
	tell(ORB_ID(actuator_motors), last); /* it hovers */
	select_mode(23, 23); settle(3);
	say("entered", 0);
	ask(above, still, 0.0f); settle(6);
	say("climbs", 0);
	ask(here, still, 0.0f); settle(60);
	ask(none, down, NAN); settle(200); /* 2 m/s down, for 0.4 s */
	say("sinks", 0);
	position.z = -4.0f; settle(60); /* that setpoint is now older than 0.5 s, since 10 samples, and the vehicle was here */
	say("holds", 0);
	/* the estimator moves its origin up by 20 m, east by 30 m, and turns its north by 2 rad: nothing happens */
	position.z -= 20.0f; position.delta_z = -20.0f; position.z_reset_counter++;
	position.y += 30.0f; position.delta_xy[1] = 30.0f; position.xy_reset_counter++;
	attitude.q[0] = std::cos(1.0f); attitude.q[3] = std::sin(1.0f); position.delta_heading = 2.0f; position.heading_reset_counter++;
	settle(12);
	say("reset", 0);
	battery_status_s low{}; low.connected = true; low.scale = 1.1f;
	tell(ORB_ID(battery_status), low); settle(1);
	say("low", 0);
	low.scale = 1.0f; tell(ORB_ID(battery_status), low);
	/* stop is refused in flight, and in any mode while armed */
	char name[] = "quadstep_control", stop[] = "stop"; char *line[] = {name, stop};
	const int stopped = quadstep_control_main(2, line);
	std::printf("\nstop %d\n", stopped);
	settle(1);
	say("flies", 0);
	const float far[3] = {0.0f, 0.0f, -1000.0f};
	ask(far, still, 2.0f); setpoint.acceleration[2] = -1000.0f; setpoint.timestamp = stub_time() + 1000;
	tell(ORB_ID(trajectory_setpoint), setpoint);
	settle(10);
	say("saturated", 0);
	select_mode(4, 4, false); settle(1);
	const int again = quadstep_control_main(2, line);
	std::printf("stop %d\n", again);
	module->Run();
	const unregister_ext_component_s gone = heard<unregister_ext_component_s>(ORB_ID(unregister_ext_component));
	std::printf("gone %d %d %d %s\n", gone.arming_check_id, gone.mode_id, gone.mode_executor_id, gone.name);
	return 0;
}
