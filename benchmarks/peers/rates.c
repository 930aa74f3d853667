/* What this core can do: fused multiply-adds and loads per second, in vectors of four. */
typedef double vector __attribute__((vector_size(32)));

#define MANY 10

double multiply_adds(long rounds) {
    vector sums[MANY], x = {0.999, 0.998, 0.997, 0.996}, y = {1e-3, 2e-3, 3e-3, 4e-3};
    for (int i = 0; i < MANY; i++) sums[i] = x * (double)i;
    for (long r = 0; r < rounds; r++)
        for (int i = 0; i < MANY; i++) sums[i] = sums[i] * x + y;
    vector total = sums[0];
    for (int i = 1; i < MANY; i++) total += sums[i];
    return total[0] + total[1] + total[2] + total[3];
}

double loads(const vector *data, long count, long rounds) {
    vector sums[MANY] = {0};
    for (long r = 0; r < rounds; r++)
        for (long k = 0; k + MANY <= count; k += MANY)
            for (int i = 0; i < MANY; i++) sums[i] += data[k + i];
    vector total = sums[0];
    for (int i = 1; i < MANY; i++) total += sums[i];
    return total[0] + total[1] + total[2] + total[3];
}
