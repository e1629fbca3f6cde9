/**
 * When a function is called. Time is tick * step: ticks are counted, so that it stays exact for hours.
 */
typedef struct
{
    uint32_t tick; /* -, steps since start() */
    real step; /* s, of a tick */
    real period; /* s, until the same function is called again */
    real age; /* s, of the measurements */
} NAME_clock;
