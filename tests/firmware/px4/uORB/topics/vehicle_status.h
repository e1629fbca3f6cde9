#pragma once
#include <uORB/stub.hpp>
struct vehicle_status_s { static constexpr uint8_t ARMING_STATE_ARMED = 2; uint64_t timestamp; uint8_t arming_state, nav_state_user_intention, nav_state; };
TOPIC(vehicle_status)
