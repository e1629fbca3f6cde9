#pragma once
#include <uORB/stub.hpp>
namespace uORB {
template<typename T> class Publication {
public:
	explicit Publication(topic_t topic) : _topic(topic) {}
	bool publish(const T &message) { Kept &kept = topics()[_topic]; const auto *start = reinterpret_cast<const unsigned char *>(&message); kept.bytes.assign(start, start + sizeof(T)); ++kept.count; return true; }
private:
	topic_t _topic;
};
}
