#include "NAME.h"
#include <string.h>
#include "NAME_golden.h"
#define SYST ((volatile uint32_t *)0xE000E010)
#define REPEATS 40
static NAME_state state, work, spare;
static NAME_measured measured;
static NAME_reference reference;
static NAME_command command;
static NAME_actuators made;
static uint32_t total[16], worst[16];
static void put(const char *text)
{
    register int r0 __asm("r0") = 4; register const char *r1 __asm("r1") = text;
    __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}
static void say(const char *what, uint32_t value)
{
    char text[16]; int i = 15; text[i] = 0;
    do { text[--i] = (char)('0' + value % 10u); value /= 10u; } while (value);
    put(what); put(" "); put(&text[i]); put("\n");
}
static void note(int which, uint32_t counts)
{
    const uint32_t instructions = counts * 40u / REPEATS;
    total[which] += instructions;
    if (instructions > worst[which]) worst[which] = instructions;
}
static uint32_t differing(const void *found, const real *wanted, unsigned size)
{
    uint32_t different = 0;
    for (unsigned i = 0; i < size / sizeof(real); ++i)
    {
        real a; memcpy(&a, (const char *)found + i * sizeof(real), sizeof a);
        different += memcmp(&a, &wanted[i], sizeof a) != 0 && !(a == 0 && wanted[i] == 0);
    }
    return different;
}
int main(void)
{
    SYST[1] = 0xFFFFFF; SYST[2] = 0; SYST[0] = 5;
    uint32_t differences = 0, reading, with;
    NAME_clock clock = {0};
    clock.step = golden_step;
    memcpy(&measured, golden_start[0], sizeof measured);
    (void)NAME_start(&NAME_mission, &state, &measured);
    for (int i = 0; i < GOLDEN_SAMPLES; ++i)
    {
        memcpy(&measured, golden_measured[i], sizeof measured);
        memcpy(&reference, golden_reference[i], sizeof reference);
        clock.tick = golden_tick[i];
BODY
        differences += differing(&command, golden_command[i], sizeof golden_command[i]);
        differences += differing(&made, golden_made[i], sizeof golden_made[i]);
    }
    MEMORY
PRINTS
    say("differences", differences);
    return 0;
}
