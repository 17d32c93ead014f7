/* sin x for x from 0 to pi / 2, by its series. */
static os_real_t KERNEL_sine(os_real_t x)
{
    os_real_t sum = (os_real_t)1;
    for (int32_t k = 22; k > 0; k -= 2) {
        const int32_t divisor = k * (k + 1);
        sum = (os_real_t)1 - ((x * x) * (sum / (os_real_t)divisor));
    }
    return x * sum;
}

/* The angle whose half has the square of its tangent given, not below; halved until a short series does. */
static os_real_t KERNEL_angle(os_real_t tangent_square)
{
    const bool obtuse = tangent_square > (os_real_t)1;
    os_real_t t = os_sqrt(obtuse ? ((os_real_t)1 / tangent_square) : tangent_square);
    os_real_t sum = (os_real_t)0;
    for (int32_t k = 0; k < 3; ++k) {
        t = t / ((os_real_t)1 + os_sqrt((os_real_t)1 + (t * t)));
    }
    for (int32_t k = 17; k > 0; k -= 2) {
        sum = ((os_real_t)1 / (os_real_t)k) - ((t * t) * sum);
    }
    const os_real_t acute = (os_real_t)16 * (t * sum);
    const os_real_t angle = obtuse ? (KERNEL_PI - acute) : acute;
    return os_fmin(angle * ((os_real_t)1 + ((os_real_t)8 * OS_EPSILON)), KERNEL_PI);
}

static os_real_t KERNEL_dot(const os_real_t *a, const os_real_t *b)
{
    return ((a[0] * b[0]) + (a[1] * b[1])) + (a[2] * b[2]);
}

static void KERNEL_cross(const os_real_t *a, const os_real_t *b, os_real_t *product)
{
    product[0] = (a[1] * b[2]) - (a[2] * b[1]);
    product[1] = (a[2] * b[0]) - (a[0] * b[2]);
    product[2] = (a[0] * b[1]) - (a[1] * b[0]);
}

static os_real_t KERNEL_cross_length(const os_real_t *a, const os_real_t *b)
{
    os_real_t product[3];
    KERNEL_cross(a, b, product);
    return os_sqrt(KERNEL_dot(product, product));
}

/* Place of an entry of a symmetric 3 x 3 matrix, row <= column, in its upper triangle by columns. */
static int32_t KERNEL_place(int32_t row, int32_t column)
{
    return row + ((column * (column + 1)) / 2);
}
