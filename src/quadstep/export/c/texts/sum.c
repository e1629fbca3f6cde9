/* Whether a number is finite; a sum is not if one of its terms is not. */
static inline bool qs_finite(real sum)
{
    return (qs_bits(sum) & MOST) != MOST;
}
