#pragma once
#include <uORB/stub.hpp>
struct parameter_update_s { uint64_t timestamp; };
TOPIC(parameter_update)
