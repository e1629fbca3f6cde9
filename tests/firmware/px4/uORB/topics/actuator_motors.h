#pragma once
#include <uORB/stub.hpp>
struct actuator_motors_s { uint64_t timestamp, timestamp_sample; uint16_t reversible_flags; float control[12]; };
TOPIC(actuator_motors)
