/* quadstep_path step|yaw|circle SIZE SECONDS: publishes trajectory_setpoint at 250 Hz from where the vehicle is, by PX4's clock, and
 * prints how far the vehicle was from it meanwhile: of a step [m] north, a turn [deg], a circle's radius [m] flown in 10 s. */
#include <px4_platform_common/log.h>
#include <px4_platform_common/px4_config.h>
#include <px4_platform_common/time.h>
#include <drivers/drv_hrt.h>
#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/topics/trajectory_setpoint.h>
#include <uORB/topics/vehicle_local_position.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

extern "C" __EXPORT int quadstep_path_main(int argc, char *argv[]);

int quadstep_path_main(int argc, char *argv[])
{
	if (argc < 4) { PX4_ERR("step|yaw|circle SIZE SECONDS"); return 1; }
	const bool step = std::strcmp(argv[1], "step") == 0, turn = std::strcmp(argv[1], "yaw") == 0;
	const float size = static_cast<float>(std::atof(argv[2])), seconds = static_cast<float>(std::atof(argv[3]));
	uORB::Subscription position_sub{ORB_ID(vehicle_local_position)};
	uORB::Publication<trajectory_setpoint_s> setpoint_pub{ORB_ID(trajectory_setpoint)};
	vehicle_local_position_s start{}, here{};
	position_sub.copy(&start);
	const hrt_abstime begin = hrt_absolute_time();
	float away = 0.0f, turned = 0.0f, count = 0.0f, phase = 0.0f;
	for (float time = 0.0f; time < seconds; time = 1e-6f * static_cast<float>(hrt_absolute_time() - begin)) {
		trajectory_setpoint_s setpoint{};
		setpoint.timestamp = hrt_absolute_time();
		setpoint.position[0] = start.x + (step ? size : 0.0f);
		setpoint.position[1] = start.y;
		setpoint.position[2] = start.z;
		setpoint.yaw = start.heading + (turn ? size * 0.0174532925f : 0.0f);
		if (!step && !turn) { /* from rest to its speed in 5 s */
			const float full = 2.0f * 3.14159265f / 10.0f, speed = time < 5.0f ? full * time / 5.0f : full, gain = time < 5.0f ? full / 5.0f : 0.0f;
			phase = time < 5.0f ? 0.5f * full * time * time / 5.0f : full * (time - 2.5f);
			const float c = std::cos(phase), s = std::sin(phase);
			setpoint.position[0] += size * (1.0f - c);
			setpoint.position[1] += size * s;
			setpoint.velocity[0] = size * speed * s;
			setpoint.velocity[1] = size * speed * c;
			setpoint.acceleration[0] = size * (gain * s + speed * speed * c);
			setpoint.acceleration[1] = size * (gain * c - speed * speed * s);
		}
		setpoint_pub.publish(setpoint);
		position_sub.copy(&here);
		if (time > 0.5f * seconds) {
			const float dx = here.x - setpoint.position[0], dy = here.y - setpoint.position[1], dz = here.z - setpoint.position[2];
			const float dw = std::remainder(here.heading - setpoint.yaw, 6.2831853f);
			away += dx * dx + dy * dy + dz * dz;
			turned += dw * dw;
			count += 1.0f;
		}
		px4_usleep(4000);
	}
	PX4_INFO_RAW("second half: rmse %.1f mm, heading %.2f deg\n", static_cast<double>(1e3f * std::sqrt(away / count)),
		     static_cast<double>(57.29578f * std::sqrt(turned / count)));
	return 0;
}
