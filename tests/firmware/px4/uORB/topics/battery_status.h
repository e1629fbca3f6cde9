#pragma once
#include <uORB/stub.hpp>
struct battery_status_s { uint64_t timestamp; bool connected; float voltage_v, remaining, scale; };
TOPIC(battery_status)
