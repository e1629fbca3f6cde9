#pragma once
#include <uORB/stub.hpp>
struct register_ext_component_request_s { uint64_t timestamp, request_id; char name[25]; uint16_t px4_ros2_api_version; bool register_arming_check, register_mode, register_mode_executor, enable_replace_internal_mode; uint8_t replace_internal_mode; bool activate_mode_immediately; };
TOPIC(register_ext_component_request)
