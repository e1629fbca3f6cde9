/* Of the Crazyflie firmware's interface, the clock; written from its documentation for tests. */
#pragma once
#include <stdint.h>
uint64_t usecTimestamp(void);
