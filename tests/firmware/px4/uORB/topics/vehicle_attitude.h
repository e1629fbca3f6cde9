#pragma once
#include <uORB/stub.hpp>
struct vehicle_attitude_s { uint64_t timestamp, timestamp_sample; float q[4], delta_q_reset[4]; uint8_t quat_reset_counter; };
TOPIC(vehicle_attitude)
