/* Of PX4's interface, what a module uses; written from its documentation for tests. One message a topic, kept in memory. */
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>
struct Kept { std::vector<unsigned char> bytes; unsigned count = 0; };
inline std::map<std::string, Kept> &topics() { static std::map<std::string, Kept> all; return all; }
using topic_t = const char *;
#define ORB_ID(name) name##_topic
#define TOPIC(name) static constexpr topic_t name##_topic = #name;
static constexpr topic_t config_control_setpoints_topic = "config_control_setpoints";
