/* quadstep_path step|yaw|circle SIZE SECONDS: publishes trajectory_setpoint at each estimate of the position, from where the vehicle is,
 * and prints how far the vehicle was from it: of a step [m] north, a turn [deg], a circle's radius [m] flown in 10 s. PX4's simulator
 * waits for work items, and not for threads, whose setpoints would be the older the busier the machine is. */
#include <px4_platform_common/log.h>
#include <px4_platform_common/px4_config.h>
#include <px4_platform_common/px4_work_queue/WorkItem.hpp>
#include <px4_platform_common/time.h>
#include <drivers/drv_hrt.h>
#include <uORB/Publication.hpp>
#include <uORB/SubscriptionCallback.hpp>
#include <uORB/topics/trajectory_setpoint.h>
#include <uORB/topics/vehicle_local_position.h>

#include <cmath>
#include <cstdlib>

extern "C" __EXPORT int quadstep_path_main(int argc, char *argv[]);

class Path final : public px4::WorkItem
{
public:
	Path(char kind, float size, float seconds) :
		WorkItem("quadstep_path", px4::wq_configurations::nav_and_controllers), _kind(kind), _size(size), _seconds(seconds)
	{
		_position_sub.registerCallback();
	}

	~Path() override { _position_sub.unregisterCallback(); }

	volatile bool over = false;
	float away = 0.0f, turned = 0.0f, count = 0.0f;

private:
	void Run() override
	{
		vehicle_local_position_s here{};
		if (over || !_position_sub.update(&here)) { return; }
		if (_start.timestamp_sample == 0) { _start = here; }
		const float time = 1e-6f * static_cast<float>(here.timestamp_sample - _start.timestamp_sample);
		if (time > _seconds) { over = true; return; }
		trajectory_setpoint_s setpoint{};
		setpoint.position[0] = _start.x + (_kind == 's' ? _size : 0.0f);
		setpoint.position[1] = _start.y;
		setpoint.position[2] = _start.z;
		setpoint.yaw = _start.heading + (_kind == 'y' ? _size * 0.0174532925f : 0.0f);
		if (_kind == 'c') { /* from rest to its speed in 5 s */
			const float full = 2.0f * 3.14159265f / 10.0f, speed = time < 5.0f ? full * time / 5.0f : full, gain = time < 5.0f ? full / 5.0f : 0.0f;
			const float phase = time < 5.0f ? 0.5f * full * time * time / 5.0f : full * (time - 2.5f);
			const float c = std::cos(phase), s = std::sin(phase);
			setpoint.position[0] += _size * (1.0f - c);
			setpoint.position[1] += _size * s;
			setpoint.velocity[0] = _size * speed * s;
			setpoint.velocity[1] = _size * speed * c;
			setpoint.acceleration[0] = _size * (gain * s + speed * speed * c);
			setpoint.acceleration[1] = _size * (gain * c - speed * speed * s);
		}
		setpoint.timestamp = hrt_absolute_time();
		_setpoint_pub.publish(setpoint);
		if (time > 0.5f * _seconds) {
			const float dx = here.x - setpoint.position[0], dy = here.y - setpoint.position[1], dz = here.z - setpoint.position[2];
			const float dw = std::remainder(here.heading - setpoint.yaw, 6.2831853f);
			away += dx * dx + dy * dy + dz * dz;
			turned += dw * dw;
			count += 1.0f;
		}
	}

	const char _kind;
	const float _size, _seconds;
	vehicle_local_position_s _start{};
	uORB::SubscriptionCallbackWorkItem _position_sub{this, ORB_ID(vehicle_local_position)};
	uORB::Publication<trajectory_setpoint_s> _setpoint_pub{ORB_ID(trajectory_setpoint)};
};

int quadstep_path_main(int argc, char *argv[])
{
	if (argc < 4) { PX4_ERR("step|yaw|circle SIZE SECONDS"); return 1; }
	Path path(argv[1][0], static_cast<float>(std::atof(argv[2])), static_cast<float>(std::atof(argv[3])));
	while (!path.over) { px4_usleep(100000); }
	PX4_INFO_RAW("second half: rmse %.1f mm, heading %.2f deg, %.0f estimates\n", static_cast<double>(1e3f * std::sqrt(path.away / path.count)),
		     static_cast<double>(57.29578f * std::sqrt(path.turned / path.count)), static_cast<double>(path.count));
	return 0;
}
