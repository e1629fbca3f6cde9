#pragma once
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#define PX4_OK 0
#define PX4_ERROR -1
#define PX4_INFO(...) std::printf(__VA_ARGS__)
#define PX4_ERR(...) std::printf(__VA_ARGS__)
#define PX4_WARN(...) std::printf(__VA_ARGS__)
#define MODULE_NAME "quadstep_control"
#define __EXPORT
#define PRINT_MODULE_DESCRIPTION(text) std::puts(text)
#define PRINT_MODULE_USAGE_NAME(name, kind)
#define PRINT_MODULE_USAGE_COMMAND(name)
#define PRINT_MODULE_USAGE_DEFAULT_COMMANDS()
static constexpr int task_id_is_work_queue = -2;
template<class T> class ModuleBase {
public:
	virtual ~ModuleBase() = default;
	virtual int print_status() { return 0; }
	static int main(int argc, char *argv[]) { return argc > 1 && std::strcmp(argv[1], "stop") == 0 ? get_instance()->request_stop() : T::task_spawn(argc, argv); }
	static T *instance() { return _object.load(); }
protected:
	static T *get_instance() { return _object.load(); }
	int request_stop() { _exits = true; return PX4_OK; }
	bool should_exit() const { return _exits; }
	static void exit_and_cleanup() { std::printf("left\n"); }
	bool _exits = false;
	static std::atomic<T *> _object;
	static int _task_id;
};
template<class T> std::atomic<T *> ModuleBase<T>::_object{nullptr};
template<class T> int ModuleBase<T>::_task_id = -1;
