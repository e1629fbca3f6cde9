
static bool qs_all_finite(const real *numbers, size_t count)
{
    real sum = numbers[0];
    for (size_t i = 1u; i < count; ++i)
    {
        sum = sum + numbers[i];
    }
    return qs_finite(sum);
}
