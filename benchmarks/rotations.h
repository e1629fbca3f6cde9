/* Turns of every flight of a block, as quaternions (w, x, y, z) and matrices. */
#ifndef ROTATIONS_H
#define ROTATIONS_H
#include "yardstick.h"

INLINE void cross(V *y, const V *a, const V *b) {
    y[0] = a[1] * b[2] - a[2] * b[1];
    y[1] = a[2] * b[0] - a[0] * b[2];
    y[2] = a[0] * b[1] - a[1] * b[0];
}

/* a b, or the conjugate of a times b where `back` is -1. */
INLINE void product(V *y, const V *a, const V *b, num back) {
    V x = back * a[1], u = back * a[2], z = back * a[3];
    y[0] = a[0] * b[0] - x * b[1] - u * b[2] - z * b[3];
    y[1] = a[0] * b[1] + x * b[0] + u * b[3] - z * b[2];
    y[2] = a[0] * b[2] - x * b[3] + u * b[0] + z * b[1];
    y[3] = a[0] * b[3] + x * b[2] - u * b[1] + z * b[0];
}

INLINE void rotation(V r[3][3], const V *q) {
    V w = q[0], x = q[1] + q[1], y = q[2] + q[2], z = q[3] + q[3];
    V xx = q[1] * x, yy = q[2] * y, zz = q[3] * z, xy = q[1] * y, xz = q[1] * z, yz = q[2] * z;
    V wx = w * x, wy = w * y, wz = w * z;
    r[0][0] = (num)1 - (yy + zz), r[0][1] = xy - wz, r[0][2] = xz + wy;
    r[1][0] = xy + wz, r[1][1] = (num)1 - (xx + zz), r[1][2] = yz - wx;
    r[2][0] = xz - wy, r[2][1] = yz + wx, r[2][2] = (num)1 - (xx + yy);
}

/* At length one, from nearly that: 1 / sqrt(1 - e) to third order. */
INLINE void straighten(V *q) {
    V e = (num)1 - (q[0] * q[0] + dot(q + 1, q + 1)), scale = (num)1 + e * ((num)0.5 + (num)0.375 * e);
    for (int i = 0; i < 4; i++) q[i] = scale * q[i];
}

/* The quaternion of a turn about v by |v|. */
INLINE void turned(V *q, const V *v) {
    V square = dot(v, v), z = (num)0.25 * square; /* of half the angle */
    V ratio = (num)0.5 + (num)0.5 * (z * POLYNOMIAL(z, S));
    q[0] = (num)1 - ((num)0.5 * z - (z * z) * POLYNOMIAL(z, C));
    if (any(z > (num)0.61)) { /* rare: beyond an eighth of a turn */
        V angle = root(square), s, c;
        turn((num)0.5 * angle, &s, &c);
        I large = z > (num)0.61;
        ratio = pick(large, s / pick(large, angle, all(1)), ratio);
        q[0] = pick(large, c, q[0]);
    }
    for (int i = 0; i < 3; i++) q[1 + i] = ratio * v[i];
}

/* The turn that a quaternion stands for: 2 atan(s / c) / s times its vector, s the length of that. */
INLINE void turn_of(V *v, const V *q) {
    V square = dot(q + 1, q + 1), sign = pick(q[0] < 0, all(-2), all(2)), cosine = size(q[0]);
    V per = (num)1 / cosine, z = square * (per * per);
    V ratio = per + per * (z * POLYNOMIAL(z, A));
    if (any(~(z < (num)0.17))) { /* rare: beyond an eighth of a turn */
        V sine = root(square);
        ratio = pick(z < (num)0.17, ratio, first_quarter(sine, cosine) / pick(sine > 0, sine, all(1)));
    }
    ratio = sign * ratio;
    for (int i = 0; i < 3; i++) v[i] = ratio * q[1 + i];
}

/* The quaternion, with w >= 0, of the attitude whose third axis is along the force and whose first is nearest the heading; returned
 * is how fast it turns about that axis where the heading turns by 1 rad/s. */
INLINE V attitude_for(V *q, const V *f, V yaw) {
    V s, c, r[3][3], squares[4], column[4];
    turn(yaw, &s, &c);
    V per = (num)1 / root(dot(f, f));
    for (int i = 0; i < 3; i++) r[i][2] = per * f[i];
    V y[3] = {-r[2][2] * s, r[2][2] * c, r[0][2] * s - r[1][2] * c}, third[3] = {r[0][2], r[1][2], r[2][2]}, x[3];
    per = (num)1 / root(dot(y, y));
    V turning = r[2][2] * (per * per);
    for (int i = 0; i < 3; i++) y[i] = r[i][1] = per * y[i];
    cross(x, y, third);
    for (int i = 0; i < 3; i++) r[i][0] = x[i];
    V a = r[2][1] - r[1][2], b = r[0][2] - r[2][0], g = r[1][0] - r[0][1];
    V d = r[1][0] + r[0][1], e = r[0][2] + r[2][0], h = r[2][1] + r[1][2];
    squares[0] = (num)1 + r[0][0] + r[1][1] + r[2][2], squares[1] = (num)1 + r[0][0] - r[1][1] - r[2][2];
    squares[2] = (num)1 - r[0][0] + r[1][1] - r[2][2], squares[3] = (num)1 - r[0][0] - r[1][1] + r[2][2];
    const V others[3][4] = {{a, squares[1], d, e}, {b, d, squares[2], h}, {g, e, h, squares[3]}};
    V best = column[0] = squares[0];
    column[1] = a, column[2] = b, column[3] = g;
    for (int j = 0; j < 3; j++) {
        I better = squares[1 + j] > best;
        for (int i = 0; i < 4; i++) column[i] = pick(better, others[j][i], column[i]);
        best = pick(better, squares[1 + j], best);
    }
    per = pick(column[0] < 0, all(-1), all(1)) / root(column[0] * column[0] + dot(column + 1, column + 1));
    for (int i = 0; i < 4; i++) q[i] = per * column[i];
    return turning;
}

#endif
