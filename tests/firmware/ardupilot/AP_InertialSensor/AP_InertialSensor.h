/* Of ArduPilot's interface, when the gyro was read last [us]; written from its documentation for tests. */
#pragma once
#include <cstdint>
struct AP_InertialSensor {
    uint32_t last = 0xFFFFFF00u;
    uint32_t get_last_update_usec() const { return last; }
};
namespace AP {
inline AP_InertialSensor &ins() { static AP_InertialSensor sensor; return sensor; }
}
