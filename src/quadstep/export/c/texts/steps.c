static inline real qs_abs(real x)
{
    return {abs}(x);
}

static inline real qs_sqrt(real x)
{
    return {sqrt}(x);
}

static inline bool qs_equal(real a, real b)
{
    return (a <= b) && (a >= b);
}

static inline {word} qs_bits(real x)
{
    {word} bits;
    (void)memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline real qs_of_bits({word} bits)
{
    real x;
    (void)memcpy(&x, &bits, sizeof x);
    return x;
}

/* 2^n for m = n + 1.5 * 2^{size} */
static inline real qs_power(real m)
{
    return qs_of_bits((qs_bits(m) + {bias}u) << {size});
}

/* x / 2^exponent, from 1/2 to 1, for a normal x > 0 */
static inline real qs_fraction(real x)
{
    return qs_of_bits((qs_bits(x) & {mantissa}) | {half});
}

static inline real qs_exponent(real x)
{
    return (real)((int32_t)((qs_bits(x) >> {size}) & {exponent}) - {less});
}
