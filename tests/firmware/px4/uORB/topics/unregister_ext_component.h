#pragma once
#include <uORB/stub.hpp>
struct unregister_ext_component_s { uint64_t timestamp; char name[25]; int8_t arming_check_id, mode_id, mode_executor_id; };
TOPIC(unregister_ext_component)
