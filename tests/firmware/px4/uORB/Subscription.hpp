#pragma once
#include <cstring>
#include <uORB/stub.hpp>
namespace uORB {
class Subscription {
public:
	explicit Subscription(topic_t topic) : _topic(topic) {}
	template<typename T> bool copy(T *message) { const Kept &kept = topics()[_topic]; if (kept.bytes.size() != sizeof(T)) { return false; } std::memcpy(message, kept.bytes.data(), sizeof(T)); _seen = kept.count; return true; }
	template<typename T> bool update(T *message) { return topics()[_topic].count != _seen && copy(message); }
private:
	topic_t _topic;
	unsigned _seen = 0;
};
}
