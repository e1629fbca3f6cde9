#pragma once
#include <uORB/stub.hpp>
struct debug_array_s { uint64_t timestamp; uint16_t id; char name[10]; float data[58]; };
TOPIC(debug_array)
