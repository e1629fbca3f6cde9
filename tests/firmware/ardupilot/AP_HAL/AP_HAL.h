/* Of ArduPilot's interface, the clock [us]; written from its documentation for tests. */
#pragma once
#include <cstdint>
namespace AP_HAL {
inline uint32_t &stub_time() { static uint32_t time = 0xFFFFFF00u; return time; } /* about to start again from zero */
inline uint32_t micros() { return stub_time(); }
inline uint64_t micros64() { return stub_time(); }
}
