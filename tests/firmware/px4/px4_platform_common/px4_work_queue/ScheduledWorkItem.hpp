#pragma once
namespace px4 {
struct wq_config_t {};
namespace wq_configurations { static constexpr wq_config_t rate_ctrl{}; }
class WorkItem { public: virtual ~WorkItem() = default; virtual void Run() = 0; };
class ScheduledWorkItem : public WorkItem { public: ScheduledWorkItem(const char *, const wq_config_t &) {} };
}
