/* TITLE as a back end of ArduPilot's AC_CustomControl: the attitude loop. */
#pragma once

#include "AC_CustomControl_config.h"

#if AP_CUSTOMCONTROL_ENABLED

#include "AC_CustomControl_Backend.h"

extern "C" {
#include "NAME.h"
}

class AC_CustomControl_Quadstep : public AC_CustomControl_Backend
{
public:
    AC_CustomControl_Quadstep(AC_CustomControl &frontend, AP_AHRS_View *&ahrs, AC_AttitudeControl *&att_control, AP_MotorsMulticopter *&motors, float dt);

    Vector3f update(void) override;
    void reset(void) override;

    static const struct AP_Param::GroupInfo var_info[];

private:
    void take_gains(void);

    AP_Float _gain[GAIN_COUNT]; /* parameters; var_info gives their names */
    NAME_params _params;        /* of the export, with these gains */
    Vector3f _mixed;
    uint32_t _refused;
    uint32_t _rejected; /* since the switch */
    float _period;
    float _longest; /* period since the last log [s] */
    uint32_t _last; /* time of the gyro's last sample [us] */
    uint32_t _ticks;
    uint32_t _status;
    uint32_t _outer[OUTER_COUNT];
    bool _started;
    NAME_state _state;
    NAME_actuators _made;
};

#endif  // AP_CUSTOMCONTROL_ENABLED
