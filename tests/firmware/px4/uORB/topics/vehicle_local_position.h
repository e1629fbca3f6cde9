#pragma once
#include <uORB/stub.hpp>
struct vehicle_local_position_s { uint64_t timestamp, timestamp_sample; bool xy_valid, z_valid, v_xy_valid, v_z_valid; float x, y, z, delta_xy[2]; uint8_t xy_reset_counter; float delta_z; uint8_t z_reset_counter; float vx, vy, vz, ax, ay, az, heading, delta_heading; uint8_t heading_reset_counter; };
TOPIC(vehicle_local_position)
