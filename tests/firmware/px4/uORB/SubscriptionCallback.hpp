#pragma once
#include <uORB/Subscription.hpp>
namespace px4 { class WorkItem; }
namespace uORB {
class SubscriptionCallbackWorkItem : public Subscription {
public:
	SubscriptionCallbackWorkItem(px4::WorkItem *, topic_t topic) : Subscription(topic) {}
	bool registerCallback() { return true; }
	void unregisterCallback() {}
};
}
