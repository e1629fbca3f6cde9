/* Registers, switches to the mode, and flies golden samples through the module; prints motor outputs beside the law's speeds. */
#include <cstdio>
#include "QuadstepControl.hpp"
#include "NAME_golden.h"
extern "C" int quadstep_control_main(int argc, char *argv[]);
template<typename T> void tell(topic_t topic, const T &message) { uORB::Publication<T>(topic).publish(message); }
template<typename T> T heard(topic_t topic) { T message{}; uORB::Subscription(topic).copy(&message); return message; }
int main()
{
	quadstep_control_main(0, nullptr);
	px4::WorkItem *module = QuadstepControl::instance();
	module->Run();
	std::printf("asked for %s\n", heard<register_ext_component_request_s>(ORB_ID(register_ext_component_request)).name);
	register_ext_component_reply_s reply{};
	reply.request_id = 42; reply.success = true; reply.mode_id = 23; reply.arming_check_id = 1;
	tell(ORB_ID(register_ext_component_reply), reply);
	arming_check_request_s check{}; check.request_id = 7;
	tell(ORB_ID(arming_check_request), check);
	module->Run();
	std::printf("checked %d %d\n", heard<arming_check_reply_s>(ORB_ID(arming_check_reply)).request_id, heard<arming_check_reply_s>(ORB_ID(arming_check_reply)).can_arm_and_run);
	vehicle_status_s status{}; status.nav_state = 23; status.arming_state = vehicle_status_s::ARMING_STATE_ARMED;
	tell(ORB_ID(vehicle_status), status);
	NAME_state law; NAME_measured measured; NAME_reference reference; NAME_command command; NAME_actuators made{};
	for (unsigned i = 0; i < 13; ++i) {
		std::memcpy(&measured, golden_measured[i], sizeof measured);
		std::memcpy(&reference, golden_reference[i], sizeof reference);
		std::memset(reference.snap, 0, sizeof reference.snap);
		measured.thrust = made.thrust; std::memcpy(measured.torque, made.torque, sizeof made.torque);
		stub_time() += 2000;
		vehicle_attitude_s attitude{}; vehicle_local_position_s position{}; trajectory_setpoint_s setpoint{}; vehicle_angular_velocity_s rates{};
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
		position.timestamp = stub_time(); rates.timestamp_sample = stub_time();
		setpoint.yaw = -reference.yaw; setpoint.yawspeed = -reference.yaw_rate;
		tell(ORB_ID(vehicle_attitude), attitude); tell(ORB_ID(vehicle_local_position), position);
		tell(ORB_ID(trajectory_setpoint), setpoint); tell(ORB_ID(vehicle_angular_velocity), rates);
		module->Run();
		if (i == 0) { NAME_reset(&law); NAME_start(&NAME_mission, &law, &measured); continue; }
		NAME_clock clock{}; clock.tick = i; clock.step = 0.002f; clock.period = 0.002f;
		if ((i - 1u) % 5u == 0u) { NAME_clock slow = clock; slow.period = 0.010f; NAME_guide(&NAME_mission, &law, &measured, &reference, &slow); }
		NAME_law(&NAME_mission, &law, &measured, &reference, &clock, &command);
		NAME_made(&NAME_mission, &command, &made);
		const actuator_motors_s motors = heard<actuator_motors_s>(ORB_ID(actuator_motors));
		std::printf("sample %.7g %.7g %.7g %.7g", motors.control[0], motors.control[1], motors.control[2], motors.control[3]);
		for (float speed : made.speeds) { std::printf(" %.7g", speed); }
		std::printf("\n");
	}
	vehicle_local_position_s position = heard<vehicle_local_position_s>(ORB_ID(vehicle_local_position));
	vehicle_angular_velocity_s rates = heard<vehicle_angular_velocity_s>(ORB_ID(vehicle_angular_velocity));
	trajectory_setpoint_s setpoint = heard<trajectory_setpoint_s>(ORB_ID(trajectory_setpoint));
	const auto step = [&](bool fresh, const vehicle_local_position_s &place, const vehicle_angular_velocity_s &turning) {
		stub_time() += 2000;
		vehicle_local_position_s here = place; vehicle_angular_velocity_s now = turning;
		here.timestamp = fresh ? stub_time() : here.timestamp; now.timestamp_sample = stub_time();
		tell(ORB_ID(vehicle_local_position), here); tell(ORB_ID(vehicle_angular_velocity), now);
		check.request_id++; tell(ORB_ID(arming_check_request), check);
		module->Run();
		if (fresh) { position.timestamp = here.timestamp; }
	};
	const auto say = [&](const char *word, int what) {
		const actuator_motors_s motors = heard<actuator_motors_s>(ORB_ID(actuator_motors));
		const arming_check_reply_s reply = heard<arming_check_reply_s>(ORB_ID(arming_check_reply));
		std::printf("%s %d %d %.7g %.7g %.7g %.7g\n", word, what, reply.can_arm_and_run, motors.control[0], motors.control[1], motors.control[2], motors.control[3]);
	};
	for (int what = 0; what < 4; ++what) {
		/* old, not valid, not finite: position; not finite: a rate */
		vehicle_local_position_s place = position; vehicle_angular_velocity_s turning = rates;
		if (what == 1) { place.z_valid = false; }
		if (what == 2) { place.vy = NAN; }
		if (what == 3) { turning.xyz[2] = INFINITY; }
		for (int i = 0; i < 49; ++i) { step(what != 0, place, turning); }
		say("young", what);
		for (int i = 0; i < 5; ++i) { step(what != 0, place, turning); }
		say("held", what);
		for (int i = 0; i < 60; ++i) { step(what != 0, place, turning); }
		say("lost", what);
		for (int i = 0; i < 10; ++i) { step(true, position, rates); }
		say("back", what);
	}
	setpoint.position[2] -= 1000.0f; setpoint.acceleration[2] = -1000.0f;
	tell(ORB_ID(trajectory_setpoint), setpoint);
	for (int i = 0; i < 10; ++i) { step(true, position, rates); }
	say("saturated", 0);
	return 0;
}
