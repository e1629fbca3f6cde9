/*
 * TITLE as a PX4 module.
 *
 * PX4's world is north, east, down and its body front, right, down; the law's are z up and front, left, up. A NaN in a setpoint
 * means that nothing is asked there. The law runs at each sample of the gyro, its slower loops every so many of them.
 */
#include "QuadstepControl.hpp"

#include <cmath>
#include <cstring>

namespace
{
constexpr float LEAST_PERIOD = 0.0002f, MOST_PERIOD = 0.02f;
constexpr uint32_t HOLD = 50; /* samples that the last command is held when the law refuses; then the motors stop */
constexpr int ROTORS = ROTOR_COUNT;
/* PX4's motor for each rotor of the mission, in its order: check it against docs/vehicles.md before the first flight */
constexpr int MOTOR[ROTORS] = {MOTOR_ORDER};
constexpr float FASTEST = FASTEST_SPEED; /* rad/s at full output */
constexpr float CURVE = 1.0f; /* share of the thrust that goes with the square of the output; THR_MDL_FAC of your vehicle */

float known(float value, float otherwise) { return std::isfinite(value) ? value : otherwise; }

/* output of 0 to 1 for a rotor's speed: curve u^2 + (1 - curve) u is its share of the largest thrust */
float output(float speed)
{
	const float share = (speed / FASTEST) * (speed / FASTEST);
	const float linear = 1.0f - CURVE;
	const float u = CURVE > 0.001f ? (std::sqrt(linear * linear + 4.0f * CURVE * share) - linear) / (2.0f * CURVE) : share;
	return u < 0.0f ? 0.0f : (u > 1.0f ? 1.0f : u);
}
}

QuadstepControl::QuadstepControl() : ScheduledWorkItem(MODULE_NAME, px4::wq_configurations::rate_ctrl)
{
	NAME_reset(&_state);
}

bool QuadstepControl::init()
{
	return _angular_velocity_sub.registerCallback();
}

void QuadstepControl::ask_for_a_mode()
{
	register_ext_component_request_s request{};
	request.timestamp = hrt_absolute_time();
	std::strncpy(request.name, "Quadstep", sizeof(request.name) - 1);
	request.request_id = 42;
	request.px4_ros2_api_version = 1;
	request.register_arming_check = true;
	request.register_mode = true;
	_register_pub.publish(request);
	_asked = true;
}

void QuadstepControl::answer_arming_check()
{
	arming_check_request_s request;
	if (!_check_sub.update(&request) || _check_id < 0) { return; }
	arming_check_reply_s reply{};
	reply.timestamp = hrt_absolute_time();
	reply.request_id = request.request_id;
	reply.registration_id = _check_id;
	reply.health_component_index = arming_check_reply_s::HEALTH_COMPONENT_INDEX_NONE;
	reply.can_arm_and_run = _refused == 0; /* PX4 leaves the mode where this is false */
	reply.mode_req_angular_velocity = true;
	reply.mode_req_attitude = true;
	reply.mode_req_local_position = true;
	_check_pub.publish(reply);
}

void QuadstepControl::say_what_is_controlled()
{
	vehicle_control_mode_s mode{};
	mode.timestamp = hrt_absolute_time();
	mode.source_id = _mode_id;
	mode.flag_multicopter_position_control_enabled = false;
	mode.flag_control_position_enabled = false;
	mode.flag_control_attitude_enabled = false;
	mode.flag_control_rates_enabled = false;
	mode.flag_control_allocation_enabled = false; /* actuator_motors comes from here */
	_mode_pub.publish(mode);
}

bool QuadstepControl::measure(NAME_measured &measured, hrt_abstime now)
{
	_attitude_sub.update(&_attitude);
	_position_sub.update(&_position);
	measured = NAME_measured{};
	measured.position[0] = _position.x;
	measured.position[1] = -_position.y;
	measured.position[2] = -_position.z;
	measured.velocity[0] = _position.vx;
	measured.velocity[1] = -_position.vy;
	measured.velocity[2] = -_position.vz;
	measured.attitude[0] = _attitude.q[0];
	measured.attitude[1] = _attitude.q[1];
	measured.attitude[2] = -_attitude.q[2];
	measured.attitude[3] = -_attitude.q[3];
	measured.rates[0] = _angular_velocity.xyz[0];
	measured.rates[1] = -_angular_velocity.xyz[1];
	measured.rates[2] = -_angular_velocity.xyz[2];
	measured.thrust = _made.thrust; /* what the last command made: laws that hedge need it */
	std::memcpy(measured.torque, _made.torque, sizeof(measured.torque));
	return _position.xy_valid && _position.z_valid && _position.v_xy_valid && _position.v_z_valid && now >= _position.timestamp;
}

void QuadstepControl::want(NAME_reference &reference, const NAME_measured &measured)
{
	_setpoint_sub.update(&_setpoint);
	reference = NAME_reference{};
	const float sign[3] = {1.0f, -1.0f, -1.0f};
	for (int i = 0; i < 3; ++i) {
		reference.position[i] = known(sign[i] * _setpoint.position[i], measured.position[i]);
		reference.velocity[i] = known(sign[i] * _setpoint.velocity[i], 0.0f);
		reference.acceleration[i] = known(sign[i] * _setpoint.acceleration[i], 0.0f);
		reference.jerk[i] = known(sign[i] * _setpoint.jerk[i], 0.0f); /* setpoints have no snap: it stays zero */
	}
	const float *q = measured.attitude;
	const float heading = std::atan2(2.0f * (q[0] * q[3] + q[1] * q[2]), 1.0f - 2.0f * (q[2] * q[2] + q[3] * q[3]));
	reference.yaw = known(-_setpoint.yaw, heading);
	reference.yaw_rate = known(-_setpoint.yawspeed, 0.0f);
}

void QuadstepControl::publish(hrt_abstime now)
{
	actuator_motors_s motors{};
	motors.timestamp = hrt_absolute_time();
	motors.timestamp_sample = now;
	for (float &one : motors.control) { one = NAN; }
	for (int i = 0; i < ROTORS; ++i) { motors.control[MOTOR[i]] = output(_made.speeds[i]); }
	_motors_pub.publish(motors);
}

void QuadstepControl::Run()
{
	if (should_exit()) {
		_angular_velocity_sub.unregisterCallback();
		unregister_ext_component_s gone{};
		gone.timestamp = hrt_absolute_time();
		gone.mode_id = _mode_id;
		_unregister_pub.publish(gone);
		exit_and_cleanup();
		return;
	}
	if (!_asked) { ask_for_a_mode(); }
	register_ext_component_reply_s reply;
	if (_registered_sub.update(&reply) && reply.request_id == 42 && reply.success) {
		_mode_id = reply.mode_id;
		_check_id = reply.arming_check_id;
		say_what_is_controlled();
	}
	answer_arming_check();
	if (!_angular_velocity_sub.update(&_angular_velocity)) { return; }
	vehicle_status_s status{};
	_status_sub.copy(&status);
	const hrt_abstime now = _angular_velocity.timestamp_sample;
	if (status.nav_state != _mode_id || status.arming_state != vehicle_status_s::ARMING_STATE_ARMED) {
		NAME_reset(&_state);
		_started = false;
		_made = NAME_actuators{};
		_refused = 0;
		return;
	}
	NAME_measured measured;
	NAME_reference reference;
	NAME_command command;
	const bool valid = measure(measured, now);
	want(reference, measured);
	if (!_started) {
		_started = valid && NAME_start(&NAME_mission, &_state, &measured) == UPPER_OK;
		_ticks = 0;
		_last = now;
		return;
	}
	const float since = 1e-6f * static_cast<float>(now - _last);
	_last = now;
	NAME_clock clock{};
	clock.tick = ++_ticks;
	clock.step = STEP_SECONDS;
	clock.period = since < LEAST_PERIOD ? LEAST_PERIOD : (since > MOST_PERIOD ? MOST_PERIOD : since);
	clock.age = valid ? 1e-6f * static_cast<float>(now - _position.timestamp) : 1e3f;
LOOPS
	_result = NAME_law(&NAME_mission, &_state, &measured, &reference, &clock, &command);
	_result |= OUTER_SUM;
	_refused = _result == UPPER_OK ? 0 : _refused + 1;
	_result |= NAME_made(&NAME_mission, &command, &_made);
	if (_refused > HOLD) { _made = NAME_actuators{}; }
	publish(now);
}

int QuadstepControl::print_status()
{
	PX4_INFO("mode %d, status %u", static_cast<int>(_mode_id), static_cast<unsigned>(_result));
	return 0;
}

int QuadstepControl::task_spawn(int argc, char *argv[])
{
	(void)argc;
	(void)argv;
	QuadstepControl *instance = new QuadstepControl();
	if (instance == nullptr) { return PX4_ERROR; }
	_object.store(instance);
	_task_id = task_id_is_work_queue;
	if (instance->init()) { return PX4_OK; }
	delete instance;
	_object.store(nullptr);
	_task_id = -1;
	return PX4_ERROR;
}

int QuadstepControl::custom_command(int argc, char *argv[])
{
	(void)argc;
	(void)argv;
	return print_usage("unknown command");
}

int QuadstepControl::print_usage(const char *reason)
{
	if (reason != nullptr) { PX4_WARN("%s", reason); }
	PRINT_MODULE_DESCRIPTION("A flight mode that flies a law exported by quadstep.");
	PRINT_MODULE_USAGE_NAME("quadstep_control", "controller");
	PRINT_MODULE_USAGE_COMMAND("start");
	PRINT_MODULE_USAGE_DEFAULT_COMMANDS();
	return 0;
}

extern "C" __EXPORT int quadstep_control_main(int argc, char *argv[])
{
	return QuadstepControl::main(argc, argv);
}
