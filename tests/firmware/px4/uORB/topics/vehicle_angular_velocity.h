#pragma once
#include <uORB/stub.hpp>
struct vehicle_angular_velocity_s { uint64_t timestamp, timestamp_sample; float xyz[3], xyz_derivative[3]; };
TOPIC(vehicle_angular_velocity)
