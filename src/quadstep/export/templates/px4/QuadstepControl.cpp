/*
 * TITLE as a PX4 module.
 *
 * PX4's world is north, east, down and its body front, right, down; the law's are z up and front, left, up. The law runs at each
 * sample of the gyro, its slower loops every so many of them.
 *
 * The setpoint is the position and heading at entry into the mode, until a trajectory_setpoint newer than the entry arrives; a NaN
 * in it means unspecified: the present position or heading, no velocity. When the last one is older than SETPOINT_OLD, the vehicle
 * holds the position and heading of that moment.
 */
#include "QuadstepControl.hpp"

#include <parameters/param.h>

#include <cmath>
#include <cstring>

namespace
{
constexpr float LEAST_PERIOD = 0.0002f, MOST_PERIOD = 0.02f;
constexpr hrt_abstime SETPOINT_OLD = 500000; /* us */
constexpr hrt_abstime LOG_EVERY = 8000; /* us */
constexpr uint16_t LOG_ID = 20819; /* of debug_array: QS */
constexpr hrt_abstime ASK_AGAIN = 1000000; /* us, until a request for the mode is repeated */
constexpr uint32_t REFUSALS = 10; /* rejected samples in a row, with the last command held, until PX4 is told to leave the mode */
constexpr int ROTORS = ROTOR_COUNT;
/* PX4's motor for each rotor of the mission, in its order: check it against docs/vehicles.md before the first flight */
constexpr int MOTOR[ROTORS] = {MOTOR_ORDER};
constexpr float FASTEST = FASTEST_SPEED; /* rad/s at full output */
constexpr float STRONGEST = FULL_THRUST; /* N of a rotor, at full output */
constexpr float WEIGHT = HOVER_THRUST; /* N */
/* thrust [1] and torques about the law's axes [m] of a newton of each rotor */
constexpr float MIX[4][ROTORS] = {MIX_ROWS};
constexpr float SETTLING = 0.1f; /* s, time constant of the measured acceleration */
/* parameters of module.yaml, and their bounds */
constexpr struct { const char *name; float least, most; } GAINS[] = {
GAIN_TABLE
	{nullptr, 0.0f, 0.0f}
};
constexpr char MODE[] = "Quadstep";

float known(float value, float otherwise) { return std::isfinite(value) ? value : otherwise; }

/* The yaw that laws mean: of the level direction at right angles to the vehicle's left, whatever its tilt. */
float heading(const float *q) { return std::atan2(2.0f * (q[0] * q[3] - q[1] * q[2]), 1.0f - 2.0f * (q[1] * q[1] + q[3] * q[3])); }

/* Seconds since a sample; none if it is from the future: drivers and estimators stamp some samples when they publish them. */
float age(hrt_abstime sampled, hrt_abstime present)
{
	return present > sampled ? 1e-6f * static_cast<float>(present - sampled) : 0.0f;
}

/* When a message was sampled; when it was published, where the sample time is not filled in. */
template<typename T> hrt_abstime sampled(const T &message)
{
	return message.timestamp_sample != 0 ? message.timestamp_sample : message.timestamp;
}

/* Normalised thrust, 0 to 1, of a rotor at a speed; PX4's outputs apply THR_MDL_FAC to it. */
float output(float speed, float battery)
{
	const float share = battery * (speed / FASTEST) * (speed / FASTEST);
	return share < 0.0f ? 0.0f : (share > 1.0f ? 1.0f : share);
}
}

QuadstepControl::QuadstepControl() : ScheduledWorkItem(MODULE_NAME, px4::wq_configurations::rate_ctrl)
{
	NAME_reset(&_state);
}

bool QuadstepControl::init()
{
	take_gains();
	return _angular_velocity_sub.registerCallback();
}

/* The gains are parameters; one that is not within its bounds leaves the gain as it was. */
void QuadstepControl::take_gains()
{
	int32_t enabled = 0;
	_scales = param_get(param_find("MC_BAT_SCALE_EN"), &enabled) == 0 && enabled != 0;
	float *const places[] = {
GAIN_PLACES
		nullptr
	};
	for (int i = 0; GAINS[i].name != nullptr; ++i) {
		float value = NAN;
		if (param_get(param_find(GAINS[i].name), &value) == 0 && value >= GAINS[i].least && value <= GAINS[i].most && std::isfinite(value)) {
			*places[i] = value;
		}
	}
}

void QuadstepControl::ask_for_a_mode(hrt_abstime present)
{
	if (_asked != 0 && present < _asked + ASK_AGAIN) { return; }
	register_ext_component_request_s request{};
	request.timestamp = present;
	std::strncpy(request.name, MODE, sizeof(request.name) - 1);
	request.request_id = 42;
	request.px4_ros2_api_version = 1;
	request.register_arming_check = true;
	request.register_mode = true;
	_register_pub.publish(request);
	_asked = present;
}

/* PX4 asks every 300 ms; told at once when the answer changes, it leaves the mode without waiting for its next question. */
void QuadstepControl::answer_arming_check()
{
	arming_check_request_s request;
	const bool able = _refused < REFUSALS;
	if (_check_sub.update(&request)) {
		_request_id = request.request_id;
	} else if (able == _able) {
		return;
	}
	if (_check_id < 0) { return; }
	_able = able;
	arming_check_reply_s reply{};
	reply.timestamp = hrt_absolute_time();
	reply.request_id = _request_id;
	reply.registration_id = _check_id;
	reply.health_component_index = arming_check_reply_s::HEALTH_COMPONENT_INDEX_NONE;
	reply.can_arm_and_run = able; /* PX4 leaves the mode where this is false */
	reply.mode_req_angular_velocity = true;
	reply.mode_req_attitude = true;
	reply.mode_req_local_alt = true;
	reply.mode_req_local_position = true; /* PX4 leaves the mode by itself where its estimate is not valid */
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

bool QuadstepControl::measure(NAME_measured &measured)
{
	_attitude_sub.update(&_attitude);
	if (_position_sub.update(&_position)) {
		const hrt_abstime last = _moved;
		_moved = sampled(_position);
		const float share = 1.0f - std::exp(-age(last, _moved) / SETTLING);
		const float now[3] = {_position.ax, -_position.ay, -_position.az};
		for (int i = 0; i < 3; ++i) { _acceleration[i] += share * (known(now[i], 0.0f) - _acceleration[i]); }
	}
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
	return _position.xy_valid && _position.z_valid && _position.v_xy_valid && _position.v_z_valid;
}

/* What the motors are told now, by whoever commands them, as thrust and torque; false where that does not carry the vehicle. */
bool QuadstepControl::commanded(NAME_measured &measured)
{
	actuator_motors_s motors;
	if (!_last_motors_sub.copy(&motors)) { return false; }
	const float newtons = STRONGEST / battery();
	float sum[4] {};
	for (int i = 0; i < ROTORS; ++i) {
		for (int k = 0; k < 4; ++k) { sum[k] += MIX[k][i] * newtons * known(motors.control[MOTOR[i]], 0.0f); }
	}
	if (!(sum[0] > 0.5f * WEIGHT)) { return false; }
	_made.thrust = measured.thrust = sum[0];
	std::memcpy(_made.torque, &sum[1], sizeof(_made.torque));
	std::memcpy(measured.torque, &sum[1], sizeof(measured.torque));
	return true;
}

/* The law takes over what is commanded now, integrals and all; on the ground it begins with nothing. */
bool QuadstepControl::begin(NAME_measured &measured)
{
	if (!commanded(measured)) {
		_made = NAME_actuators{};
		_made.thrust = measured.thrust = WEIGHT;
		return NAME_start(&_params, &_state, &measured) == UPPER_OK;
	}
	NAME_reference present = _hold;
	std::memcpy(present.velocity, measured.velocity, sizeof(present.velocity));
	std::memcpy(present.acceleration, _acceleration, sizeof(present.acceleration));
	return NAME_enter(&_params, &_state, &measured, &present) == UPPER_OK;
}

/* The measured position and heading become the setpoint. */
void QuadstepControl::hold_here(const NAME_measured &measured)
{
	_hold = NAME_reference{};
	std::memcpy(_hold.position, measured.position, sizeof(_hold.position));
	_hold.yaw = heading(measured.attitude);
	_resets[0] = _position.xy_reset_counter;
	_resets[1] = _position.z_reset_counter;
	_resets[2] = _position.heading_reset_counter;
}

/* Where the estimator moves its origin or heading, the setpoint moves with it, and the vehicle stays where it is. */
void QuadstepControl::follow_resets()
{
	const bool older = _setpoint.timestamp < _position.timestamp; /* a newer one knows of the reset */
	if (_resets[0] != _position.xy_reset_counter) {
		_hold.position[0] += _position.delta_xy[0];
		_hold.position[1] -= _position.delta_xy[1];
		if (older) {
			_setpoint.position[0] += _position.delta_xy[0];
			_setpoint.position[1] += _position.delta_xy[1];
		}
	}
	if (_resets[1] != _position.z_reset_counter) {
		_hold.position[2] -= _position.delta_z;
		if (older) { _setpoint.position[2] += _position.delta_z; }
	}
	if (_resets[2] != _position.heading_reset_counter) {
		_hold.yaw -= _position.delta_heading;
		if (older) { _setpoint.yaw += _position.delta_heading; }
	}
	_resets[0] = _position.xy_reset_counter;
	_resets[1] = _position.z_reset_counter;
	_resets[2] = _position.heading_reset_counter;
}

void QuadstepControl::want(NAME_reference &reference, const NAME_measured &measured, hrt_abstime present)
{
	_setpoint_sub.update(&_setpoint);
	follow_resets();
	const bool follows = _setpoint.timestamp > _entered && present <= _setpoint.timestamp + SETPOINT_OLD;
	if (_follows && !follows) { hold_here(measured); }
	_follows = follows;
	reference = _hold;
	if (!follows) { return; }
	const float sign[3] = {1.0f, -1.0f, -1.0f};
	for (int i = 0; i < 3; ++i) {
		reference.position[i] = known(sign[i] * _setpoint.position[i], measured.position[i]);
		reference.velocity[i] = known(sign[i] * _setpoint.velocity[i], 0.0f);
		reference.acceleration[i] = known(sign[i] * _setpoint.acceleration[i], 0.0f);
		reference.jerk[i] = known(sign[i] * _setpoint.jerk[i], 0.0f); /* setpoints have no snap: it stays zero */
	}
	reference.yaw = known(-_setpoint.yaw, heading(measured.attitude));
	reference.yaw_rate = known(-_setpoint.yawspeed, 0.0f);
}

/* The factor of normalised thrust that makes up for the battery's voltage: thrust goes with its square. */
float QuadstepControl::battery()
{
	battery_status_s status;
	if (_scales && _battery_sub.update(&status) && status.connected && status.scale >= 1.0f) { _scale = status.scale; }
	return _scale * _scale;
}

void QuadstepControl::publish(hrt_abstime now)
{
	actuator_motors_s motors{};
	motors.timestamp = hrt_absolute_time();
	motors.timestamp_sample = now;
	for (float &one : motors.control) { one = NAN; }
	const float scale = battery();
	for (int i = 0; i < ROTORS; ++i) { motors.control[MOTOR[i]] = output(_made.speeds[i], scale); }
	_motors_pub.publish(motors);
}

/* The motors' last output again: PX4's simulators wait for one at every sample of the gyro. */
void QuadstepControl::repeat(hrt_abstime now)
{
	actuator_motors_s motors;
	if (!_last_motors_sub.copy(&motors)) { return; }
	motors.timestamp = hrt_absolute_time();
	motors.timestamp_sample = now;
	_motors_pub.publish(motors);
}

/* The law's own signals in PX4's axes, for the flight log; docs/export-px4.md lists them. */
void QuadstepControl::log(const NAME_command &command, const NAME_reference &reference, float period)
{
	_longest = std::fmax(_longest, period);
	_rejected += _refused != 0 ? 1 : 0;
	const hrt_abstime present = hrt_absolute_time();
	if (present < _logged + LOG_EVERY) { return; }
	debug_array_s said{};
	said.timestamp = present;
	said.id = LOG_ID;
	std::strncpy(said.name, MODE, sizeof(said.name) - 1);
	const float first[] = {static_cast<float>(_result), static_cast<float>(_rejected), _longest, _scale, -reference.yaw, command.thrust, _made.thrust};
	std::memcpy(said.data, first, sizeof(first));
	const float sign[3] = {1.0f, -1.0f, -1.0f};
	for (int i = 0; i < 3; ++i) {
		said.data[7 + i] = sign[i] * command.torque[i];
		said.data[10 + i] = sign[i] * _made.torque[i];
		said.data[13 + i] = sign[i] * reference.position[i];
	}
	/* from 16 on the law's memory and last command, as NAME.h declares them, as far as there is room */
	const size_t room = sizeof(said.data) - 16 * sizeof(float), memory = sizeof(_state) - sizeof(_state.ready);
	std::memcpy(&said.data[16], &_state, memory < room ? memory : room);
	_log_pub.publish(said);
	_longest = 0.0f;
	_logged = present;
}

void QuadstepControl::leave()
{
	_angular_velocity_sub.unregisterCallback();
	unregister_ext_component_s gone{};
	gone.timestamp = hrt_absolute_time();
	std::strncpy(gone.name, MODE, sizeof(gone.name) - 1); /* PX4 removes a mode only by its name */
	gone.arming_check_id = _check_id;
	gone.mode_id = _check_id < 0 ? -1 : static_cast<int8_t>(_mode_id);
	gone.mode_executor_id = -1;
	_unregister_pub.publish(gone);
	exit_and_cleanup();
}

/* Rejected samples in a row; PX4 leaves the mode after some. */
void QuadstepControl::note(bool refused)
{
	_refused = refused ? _refused + 1 : 0;
	answer_arming_check();
}

void QuadstepControl::Run()
{
	vehicle_status_s status{};
	_status_sub.copy(&status);
	_armed = status.arming_state == vehicle_status_s::ARMING_STATE_ARMED;
	if (should_exit() && !_armed) { /* in flight the vehicle is flown on: stop_refused() */
		leave();
		return;
	}
	parameter_update_s changed;
	if (_changed_sub.update(&changed)) { take_gains(); }
	const hrt_abstime present = hrt_absolute_time();
	register_ext_component_reply_s reply;
	if (_registered_sub.update(&reply) && reply.request_id == 42 && reply.success) {
		_mode_id = reply.mode_id;
		_check_id = reply.arming_check_id;
		say_what_is_controlled();
	}
	if (_check_id < 0) { ask_for_a_mode(present); }
	answer_arming_check();
	if (!_angular_velocity_sub.update(&_angular_velocity)) { return; }
	const hrt_abstime now = _angular_velocity.timestamp_sample;
	NAME_measured measured;
	const bool valid = measure(measured);
	if (status.nav_state != _mode_id || !_armed) {
		NAME_reset(&_state);
		_started = false;
		_follows = false;
		/* once it gave up, it is able again when the pilot has chosen another mode: PX4 does not return here by itself */
		if (status.nav_state_user_intention != _mode_id || !_armed) { note(false); }
		if (status.nav_state == _mode_id) { repeat(now); }
		return;
	}
	NAME_reference reference;
	NAME_command command;
	if (!_started) {
		hold_here(measured);
		_started = valid && begin(measured);
		_entered = present;
		_follows = false;
		_ticks = _rejected = 0;
		_last = now;
		note(!_started);
		repeat(now);
		return;
	}
	want(reference, measured, present);
	const float since = now > _last ? 1e-6f * static_cast<float>(now - _last) : STEP_SECONDS;
	_last = now;
	NAME_clock clock{};
	clock.tick = ++_ticks;
	clock.step = STEP_SECONDS;
	clock.period = since < LEAST_PERIOD ? LEAST_PERIOD : (since > MOST_PERIOD ? MOST_PERIOD : since);
	clock.age = std::fmax(age(sampled(_position), present), age(sampled(_attitude), present));
	clock.age = valid ? std::fmax(clock.age, age(now, present)) : 1e3f;
LOOPS
	_result = NAME_law(&_params, &_state, &measured, &reference, &clock, &command);
	_result |= OUTER_SUM;
	note(_result != UPPER_OK);
	_result |= NAME_made(&_params, &command, &_made); /* where the law rejects its input, of the last command */
	publish(now);
	log(command, reference, clock.period);
}

int QuadstepControl::print_status()
{
	PX4_INFO("mode %d, status %u, %s", static_cast<int>(_mode_id), static_cast<unsigned>(_result), _follows ? "follows setpoints" : "holds");
	return 0;
}

/* Whether `quadstep_control stop` is refused: PX4 forgets modes only while disarmed, and the motors would keep their last output. */
bool QuadstepControl::stop_refused()
{
	const QuadstepControl *instance = get_instance();
	return instance != nullptr && instance->_armed;
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
	if (argc > 1 && std::strcmp(argv[1], "stop") == 0 && QuadstepControl::stop_refused()) {
		PX4_ERR("the vehicle is armed: change to another mode, land and disarm before stopping this one");
		return PX4_ERROR;
	}
	return QuadstepControl::main(argc, argv);
}
