#pragma once
#include <uORB/stub.hpp>
struct arming_check_request_s { uint64_t timestamp; uint8_t request_id; uint32_t valid_registrations_mask; };
TOPIC(arming_check_request)
