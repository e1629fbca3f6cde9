/* What the guards of an exported law promise, number by number. Prints what is broken; returns 0 if nothing is. */
#include "NAME.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "NAME_golden.h"

static NAME_state state;
static NAME_measured measured;
static NAME_reference reference;
static NAME_command command, last;
static NAME_actuators made;
static NAME_clock sample;
static int failures;

static void expect(const char *what, int place, int holds)
{
    if (!holds)
    {
        printf("%s %d\n", what, place);
        ++failures;
    }
}

static uint32_t law(void)
{
    memset(&command, 0x55, sizeof command);
    return NAME_law(&NAME_mission, &state, &measured, &reference, &sample, &command);
}

static uint32_t guide(void)
{
    return NAME_guide(&NAME_mission, &state, &measured, &reference, &sample);
}

/* What is refused leaves the memory as it was, and the command is the last one. */
static void refused(const char *what, int place, uint32_t (*function)(void), uint32_t wanted)
{
    const NAME_state before = state;
    expect(what, place, function() == wanted);
    expect("memory", place, memcmp(&before, &state, sizeof state) == 0);
    if (function == law)
    {
        expect("command", place, memcmp(&command, &last, sizeof command) == 0);
    }
}

static void spoil(const char *what, void *numbers, const int *places, int count, uint32_t (*function)(void))
{
    const real bad[3] = {(real)NAN, (real)INFINITY, -(real)INFINITY};
    for (int i = 0; i < count; ++i)
    {
        real *const entry = &((real *)numbers)[places[i]];
        const real kept = *entry;
        for (int k = 0; k < 3; ++k)
        {
            *entry = bad[k];
            refused(what, places[i], function, UPPER_NOT_FINITE);
        }
        *entry = kept;
    }
}

static void start(void)
{
    memcpy(&measured, golden_measured[0], sizeof measured);
    memcpy(&reference, golden_reference[0], sizeof reference);
    expect("start", 0, NAME_start(&NAME_mission, &state, &measured) == UPPER_OK);
    expect("guide", 0, guide() == UPPER_OK);
    expect("law", 0, law() == UPPER_OK);
    last = command;
}

int main(void)
{
    static const int by_start[] = {START}, by_guide[] = {GUIDE}, by_law[] = {LAW}, wanted[] = {WANTED};
    const NAME_command nothing = {0};
    const real ages[3] = {NAME_mission.most_age * (real)1.01, (real)INFINITY, (real)NAN};
    sample.step = golden_step;
    sample.period = golden_law_period;

    NAME_reset(&state);
    last = nothing;
    refused("law before start", 0, law, UPPER_NOT_STARTED);
    refused("guide before start", 0, guide, UPPER_NOT_STARTED);
    for (size_t i = 0u; i < sizeof by_start / sizeof by_start[0]; ++i)
    {
        memcpy(&measured, golden_measured[0], sizeof measured);
        ((real *)(void *)&measured)[by_start[i]] = (real)NAN;
        expect("start with NaN", (int)i, NAME_start(&NAME_mission, &state, &measured) == UPPER_NOT_FINITE);
        refused("law after that", (int)i, law, UPPER_NOT_STARTED);
    }
    start();
    spoil("law, measured", &measured, by_law, (int)(sizeof by_law / sizeof by_law[0]), law);
    spoil("guide, measured", &measured, by_guide, (int)(sizeof by_guide / sizeof by_guide[0]), guide);
    spoil("guide, reference", &reference, wanted, (int)(sizeof wanted / sizeof wanted[0]), guide);
    sample.age = NAME_mission.most_age;
    expect("just fresh", 0, law() == UPPER_OK);
    last = command;
    for (int i = 0; i < 3; ++i)
    {
        sample.age = ages[i];
        refused("old law", i, law, UPPER_STALE);
        refused("old guide", i, guide, UPPER_STALE);
    }
    sample.age = (real)0.0;
    {
        NAME_params broken = NAME_mission;
        for (size_t i = 0u; i < sizeof broken.gains / sizeof(real); ++i)
        {
            ((real *)(void *)&broken.gains)[i] = (real)NAN;
        }
        expect("diverged", 0, NAME_law(&broken, &state, &measured, &reference, &sample, &command) == UPPER_DIVERGED);
        expect("command of a law that diverged", 0, memcmp(&command, &last, sizeof command) == 0);
        refused("law after that", 0, law, UPPER_NOT_STARTED);
        start();
    }
    memset(&command, 0, sizeof command);
    command.thrust = WEIGHT;
    expect("hovering is made", 0, NAME_made(&NAME_mission, &command, &made) == UPPER_OK);
    for (int i = 0; i < 4; ++i)
    {
        command = nothing;
        *(i == 0 ? &command.thrust : &command.torque[i - 1]) = (real)1e6;
        expect("too much is said", i, NAME_made(&NAME_mission, &command, &made) == UPPER_SATURATED);
        for (size_t k = 0u; k < sizeof made.speeds / sizeof(real); ++k)
        {
            expect("and held", i, (made.speeds[k] >= (real)0.0) && (made.speeds[k] <= FASTEST * (real)1.00001));
        }
    }
    return failures == 0 ? 0 : 1;
}
