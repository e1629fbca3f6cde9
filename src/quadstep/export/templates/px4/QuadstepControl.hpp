/* TITLE as a PX4 module: a flight mode of its own that publishes actuator_motors. */
#pragma once

#include <px4_platform_common/module.h>
#include <px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp>
#include <drivers/drv_hrt.h>
#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/SubscriptionCallback.hpp>
#include <uORB/topics/actuator_motors.h>
#include <uORB/topics/arming_check_reply.h>
#include <uORB/topics/arming_check_request.h>
#include <uORB/topics/battery_status.h>
#include <uORB/topics/debug_array.h>
#include <uORB/topics/parameter_update.h>
#include <uORB/topics/register_ext_component_reply.h>
#include <uORB/topics/register_ext_component_request.h>
#include <uORB/topics/trajectory_setpoint.h>
#include <uORB/topics/unregister_ext_component.h>
#include <uORB/topics/vehicle_angular_velocity.h>
#include <uORB/topics/vehicle_attitude.h>
#include <uORB/topics/vehicle_control_mode.h>
#include <uORB/topics/vehicle_local_position.h>
#include <uORB/topics/vehicle_status.h>

#include "NAME.h"

class QuadstepControl : public ModuleBase<QuadstepControl>, public px4::ScheduledWorkItem
{
public:
	QuadstepControl();
	~QuadstepControl() override = default;

	static int task_spawn(int argc, char *argv[]);
	static int custom_command(int argc, char *argv[]);
	static int print_usage(const char *reason = nullptr);

	static bool stop_refused();

	bool init();
	int print_status() override;

private:
	void Run() override;
	void take_gains();
	void ask_for_a_mode(hrt_abstime present);
	void answer_arming_check();
	void say_what_is_controlled();
	bool measure(NAME_measured &measured);
	bool commanded(NAME_measured &measured);
	bool begin(NAME_measured &measured);
	void hold_here(const NAME_measured &measured);
	void follow_resets();
	void want(NAME_reference &reference, const NAME_measured &measured, hrt_abstime present);
	float battery();
	void publish(hrt_abstime now);
	void log(const NAME_command &command, const NAME_reference &reference, float period);
	void repeat(hrt_abstime now);
	void leave();
	void note(bool refused);

	uORB::SubscriptionCallbackWorkItem _angular_velocity_sub{this, ORB_ID(vehicle_angular_velocity)};
	uORB::Subscription _changed_sub{ORB_ID(parameter_update)};
	uORB::Subscription _attitude_sub{ORB_ID(vehicle_attitude)};
	uORB::Subscription _position_sub{ORB_ID(vehicle_local_position)};
	uORB::Subscription _setpoint_sub{ORB_ID(trajectory_setpoint)};
	uORB::Subscription _battery_sub{ORB_ID(battery_status)};
	uORB::Subscription _status_sub{ORB_ID(vehicle_status)};
	uORB::Subscription _registered_sub{ORB_ID(register_ext_component_reply)};
	uORB::Subscription _check_sub{ORB_ID(arming_check_request)};
	uORB::Subscription _last_motors_sub{ORB_ID(actuator_motors)};
	uORB::Publication<actuator_motors_s> _motors_pub{ORB_ID(actuator_motors)};
	uORB::Publication<register_ext_component_request_s> _register_pub{ORB_ID(register_ext_component_request)};
	uORB::Publication<unregister_ext_component_s> _unregister_pub{ORB_ID(unregister_ext_component)};
	uORB::Publication<arming_check_reply_s> _check_pub{ORB_ID(arming_check_reply)};
	uORB::Publication<vehicle_control_mode_s> _mode_pub{ORB_ID(config_control_setpoints)};
	uORB::Publication<debug_array_s> _log_pub{ORB_ID(debug_array)};

	vehicle_angular_velocity_s _angular_velocity{};
	vehicle_attitude_s _attitude{};
	vehicle_local_position_s _position{};
	trajectory_setpoint_s _setpoint{};

	NAME_params _params{NAME_mission}; /* of the export, with the gains of the parameters */
	NAME_state _state{};
	NAME_actuators _made{};
	float _acceleration[3] {}; /* measured, the law's axes */
	hrt_abstime _moved{0};
	uint32_t _result{0};
	uint32_t _refused{0};
	uint32_t _rejected{0}; /* since the entry */
	float _longest{0.0f}; /* period since the last log [s] */
	hrt_abstime _logged{0};
	uint32_t _outer[OUTER_COUNT] {};
	uint32_t _ticks{0};
	hrt_abstime _last{0};
	hrt_abstime _asked{0};
	hrt_abstime _entered{0};
	NAME_reference _hold{};
	uint8_t _resets[3] {};
	float _scale{1.0f};
	bool _scales{false};
	bool _started{false};
	bool _follows{false};
	bool _armed{false};
	bool _able{true};
	uint8_t _request_id{0};
	uint8_t _mode_id{255};
	int8_t _check_id{-1};
};
