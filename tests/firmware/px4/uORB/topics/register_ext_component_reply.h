#pragma once
#include <uORB/stub.hpp>
struct register_ext_component_reply_s { uint64_t timestamp, request_id; char name[25]; uint16_t px4_ros2_api_version; bool success; int8_t arming_check_id, mode_id, mode_executor_id; };
TOPIC(register_ext_component_reply)
