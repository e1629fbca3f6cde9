#include "NAME.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "NAME_golden.h"

/* Compares numbers bit for bit; -0 and 0 count as equal. */
static int compare(const char *what, int sample, const void *found, const real *wanted, size_t size)
{
    int failures = 0;
    for (size_t i = 0u; i < size / sizeof(real); ++i)
    {
        real value;
        WORD found_bits;
        WORD wanted_bits;
        memcpy(&value, (const unsigned char *)found + i * sizeof(real), sizeof value);
        memcpy(&found_bits, &value, sizeof found_bits);
        memcpy(&wanted_bits, &wanted[i], sizeof wanted_bits);
        if ((found_bits != wanted_bits) && (((found_bits | wanted_bits) << 1) != 0u))
        {
            if (failures == 0)
            {
                printf("sample %d, %s[%d]: %.17g instead of %.17g\n", sample, what, (int)i, (double)value, (double)wanted[i]);
            }
            ++failures;
        }
    }
    return failures;
}

static int expect(const char *what, int holds)
{
    if (!holds)
    {
        printf("%s: not the status that was expected\n", what);
    }
    return holds ? 0 : 1;
}

static NAME_state state;
static NAME_measured measured;
static NAME_reference reference;
static NAME_command command;
static NAME_actuators made;

int main(void)
{
    int failures = 0;
    NAME_clock clock = {0};
    clock.step = golden_step;
    clock.period = golden_law_period;

    memcpy(&measured, golden_start[0], sizeof measured);
    memcpy(&reference, golden_reference[0], sizeof reference);
    NAME_reset(&state);
    failures += expect("law before start", NAME_law(&NAME_mission, &state, &measured, &reference, &clock, &command) == UPPER_NOT_STARTED);
    failures += expect("start", NAME_start(&NAME_mission, &state, &measured) == UPPER_OK);
    for (int i = 0; i < GOLDEN_SAMPLES; ++i)
    {
        memcpy(&measured, golden_measured[i], sizeof measured);
        memcpy(&reference, golden_reference[i], sizeof reference);
        clock.tick = golden_tick[i];
LOOPS
        clock.period = golden_law_period;
        failures += expect("law", NAME_law(&NAME_mission, &state, &measured, &reference, &clock, &command) == UPPER_OK);
        (void)NAME_made(&NAME_mission, &command, &made);
        failures += compare("command", i, &command, golden_command[i], sizeof golden_command[i]);
        failures += compare("made", i, &made, golden_made[i], sizeof golden_made[i]);
    }
MEMORY
    const int last = GOLDEN_SAMPLES - 1;
    {
        const NAME_state before = state;
        NAME_command after = command;
        real *const entry = &((real *)(void *)&measured)[READ];
        const real kept = *entry;
        *entry = (real)NAN;
        failures += expect("NaN", NAME_law(&NAME_mission, &state, &measured, &reference, &clock, &after) == UPPER_NOT_FINITE);
        failures += compare("command after NaN", last, &after, golden_command[last], sizeof golden_command[last]);
        *entry = kept;
        clock.age = (real)1000.0;
        failures += expect("old", NAME_law(&NAME_mission, &state, &measured, &reference, &clock, &after) == UPPER_STALE);
        failures += compare("command after an old sample", last, &after, golden_command[last], sizeof golden_command[last]);
        failures += expect("memory is kept", memcmp(&before, &state, sizeof state) == 0);
    }
ENTERED
    printf(failures == 0 ? "%d samples: the same bits\n" : "%d samples: differences\n", GOLDEN_SAMPLES);
    return failures == 0 ? 0 : 1;
}
