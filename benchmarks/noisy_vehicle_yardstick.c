/* The same with turbulence and with noise in every sensor: the flights of `airframes.FULL`. */
#define NOISE 1
#include "vehicle_yardstick.c"
