/* Of the Crazyflie firmware's interface, what a controller uses; written from its documentation for tests. */
#pragma once
#include <stdbool.h>
#include <stdint.h>
typedef struct { uint32_t timestamp; float x, y, z; } point_t;
typedef point_t velocity_t;
typedef point_t acc_t;
typedef point_t jerk_t;
typedef struct { uint32_t timestamp; float roll, pitch, yaw; } attitude_t;
typedef struct { uint32_t timestamp; union { struct { float q0, q1, q2, q3; }; struct { float x, y, z, w; }; }; } quaternion_t;
typedef union { struct { float x, y, z; }; float axis[3]; } Axis3f;
typedef struct { Axis3f acc; Axis3f gyro; Axis3f mag; uint64_t interruptTimestamp; } sensorData_t;
typedef struct { attitude_t attitude; quaternion_t attitudeQuaternion; point_t position; velocity_t velocity; acc_t acc; } state_t;
typedef enum { modeDisable = 0, modeAbs, modeVelocity } stab_mode_t;
typedef struct {
  uint32_t timestamp;
  attitude_t attitude; attitude_t attitudeRate; quaternion_t attitudeQuaternion; float thrust;
  point_t position; velocity_t velocity; acc_t acceleration; jerk_t jerk;
  bool velocity_body;
  struct { stab_mode_t x, y, z, roll, pitch, yaw, quat; } mode;
} setpoint_t;
typedef enum { controlModeLegacy = 0, controlModeForceTorque = 1, controlModeForce = 2, controlModePWM = 3 } control_mode_t;
typedef struct {
  union {
    struct { int16_t roll, pitch, yaw; float thrust; };
    struct { float thrustSi; union { float torque[3]; struct { float torqueX, torqueY, torqueZ; }; }; };
    float normalizedForces[4];
  };
  control_mode_t controlMode;
} control_t;
typedef uint32_t stabilizerStep_t;
