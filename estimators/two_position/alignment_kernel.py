r"""The loop of `estimators.two_position.alignment`: velocities and attitudes into sums for each rest.

With v what the static mechanisation adds to the velocity since a rest began, x = t / `SPAN` the scaled time in it, and
R_n(t) = exp([omega_ie t x]) the turn of the navigation frame since the first reading, a rest's sums are

    sum x^q (q = 0..6),     sum x^i v_j (i = 0..3; j east, north, up),

taken at every sample. J = integral of R_n C_b^n dt, by which gyro biases have entered the attitude, goes on through
the turns; it is taken by trapezoids from sample to sample while the body turns, of `LATTICE` samples at rest. So is
the twist S = integral of R_n C_b^n w_z dt while the body turns, w_z the rate that it turns at about z less the Earth's,
by which the z gyro's scale factor and the misalignments of x and y to z have entered the attitude. Blocks of ``block``
samples keep the mean velocity, J and S for those who ask.

Each row runs alone through the same loop: chunks and batches make no difference.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from insenv.core.compiled import jit, patient

#: Time that is one in the sums [s].
SPAN = 300.0
#: Rests that are told apart; what follows the last is not used.
RESTS = 4
#: Samples between two values of R_n C_b^n at rest.
LATTICE = 50
#: Places in the array of a row: number of the rest, samples to be left out, samples in the rest, velocity at its start
#: and before the present sample, time and value of the last R_n C_b^n, J, sums and fill of the present block, S.
REST, LEFT, COUNT, START, BEFORE, TIME, LAST, J, BLOCK, FILL, TWIST, WIDTH = 0, 1, 2, 3, 6, 9, 10, 19, 28, 30, 31, 40
#: Sums of a rest: 7 powers, 4 x 3 moments, time of its start, J, R_n C_b^n and S there.
POWERS, MOMENTS, BEGAN, J_START, A_START, TWIST_START, SUMS = 0, 7, 19, 20, 29, 38, 47
#: A block: rest that it lies in whole (-1: none), time of its end, mean velocity east and north, J and S at its end.
WHERE, END, MEAN, J_END, TWIST_END, CELL = 0, 1, 2, 4, 13, 22


@jit
def frame(t, rate, out):
    """R_n(t) = exp([omega t x]), omega = (0, north, up), into out, shape (3, 3)."""
    size = math.sqrt(rate[0] * rate[0] + rate[1] * rate[1])
    if size == 0.0:
        n, u = 0.0, 1.0
    else:
        n, u = rate[0] / size, rate[1] / size
    s = math.sin(size * t)
    half = math.sin(0.5 * size * t)
    c = 2.0 * half * half
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - c, -u * s, n * s
    out[1, 0], out[1, 1], out[1, 2] = u * s, 1.0 - u * u * c, n * u * c
    out[2, 0], out[2, 1], out[2, 2] = -n * s, n * u * c, 1.0 - n * n * c


@jit
def _inertial(q, t, rate, r, out):
    """R_n(t) C_b^n of the quaternion q, nine numbers into out."""
    frame(t, rate, r)
    w, x, y, z = q[0], q[1], q[2], q[3]
    c00, c01, c02 = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    c10, c11, c12 = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    c20, c21, c22 = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    for i in range(3):
        out[3 * i] = r[i, 0] * c00 + r[i, 1] * c10 + r[i, 2] * c20
        out[3 * i + 1] = r[i, 0] * c01 + r[i, 1] * c11 + r[i, 2] * c21
        out[3 * i + 2] = r[i, 0] * c02 + r[i, 1] * c12 + r[i, 2] * c22


@jit
def _onward(row, a, t):
    """J up to t, where R_n C_b^n is a."""
    half = 0.5 * (t - row[TIME])
    for k in range(9):
        row[J + k] += half * (row[LAST + k] + a[k])
        row[LAST + k] = a[k]
    row[TIME] = t


@patient
def begin(quaternion, rate, rows, r, a):
    """R_n C_b^n before the first sample."""
    for i in range(rows.shape[0]):
        _inertial(quaternion[i], 0.0, rate, r, a)
        rows[i, REST], rows[i, COUNT] = -1.0, -1.0
        for k in range(9):
            rows[i, LAST + k] = a[k]


@patient
def gather(  # noqa: C901, PLR0912, PLR0913, PLR0915 -- one loop over samples; numba wants it in one function
    velocity, attitude, turning, about_z, numbers, rows, sums, cells, where, r, a
):
    """Take a chunk in.

    velocity, attitude : of the mechanisation at the ends of the samples, shapes (R, n, 3) and (R, n, 4).
    turning : shape (R, n), not zero while the body turns. about_z : increments of the z gyro, shape (R, n).
    numbers : dt, samples before, samples per block, samples
    left out after a turn, Earth rate north and up. rows : (R, WIDTH). sums : (R, RESTS, SUMS).
    cells : (R, blocks that end in the chunk, CELL), or none. where : (R, n), the rest of each sample (-1: none), or
    shape (R, 0). r, a : scratch of shapes (3, 3) and (9,).
    """
    dt, first, size, settle = numbers[0], int(numbers[1]), int(numbers[2]), numbers[3]
    rate = (numbers[4], numbers[5])
    for i in range(rows.shape[0]):
        row, done = rows[i], 0
        for k in range(velocity.shape[1]):
            sample = first + k + 1
            t = sample * dt
            moves = turning[i, k] != 0.0
            if moves:
                row[LEFT], row[COUNT] = settle, -1.0
            elif row[LEFT] > 0.0:
                row[LEFT] -= 1.0
                moves = True
            elif row[COUNT] < 0.0:
                row[REST], row[COUNT] = row[REST] + 1.0, 0.0
                for j in range(3):
                    row[START + j] = row[BEFORE + j]
                if row[REST] < RESTS:
                    rest = sums[i, int(row[REST])]
                    rest[BEGAN] = t - dt
                    for j in range(9):
                        rest[J_START + j], rest[A_START + j] = row[J + j], row[LAST + j]
                        rest[TWIST_START + j] = row[TWIST + j]
            if moves or sample % LATTICE == 0 or sample % size == 0:
                _inertial(attitude[i, k], t, rate, r, a)
                if moves:
                    half = 0.5 * (about_z[i, k] - rate[1] * dt)
                    for j in range(9):
                        row[TWIST + j] += half * (row[LAST + j] + a[j])
                _onward(row, a, t)
            if not moves:
                row[COUNT] += 1.0
                row[FILL] += 1.0
                e = velocity[i, k, 0] - row[START]
                n = velocity[i, k, 1] - row[START + 1]
                row[BLOCK] += e
                row[BLOCK + 1] += n
                if row[REST] < RESTS:
                    u = velocity[i, k, 2] - row[START + 2]
                    rest = sums[i, int(row[REST])]
                    x = row[COUNT] * (dt / SPAN)
                    x2 = x * x
                    x3 = x2 * x
                    rest[0] += 1.0
                    rest[1] += x
                    rest[2] += x2
                    rest[3] += x3
                    rest[4] += x2 * x2
                    rest[5] += x3 * x2
                    rest[6] += x3 * x3
                    rest[MOMENTS] += e
                    rest[MOMENTS + 1] += n
                    rest[MOMENTS + 2] += u
                    rest[MOMENTS + 3] += x * e
                    rest[MOMENTS + 4] += x * n
                    rest[MOMENTS + 5] += x * u
                    rest[MOMENTS + 6] += x2 * e
                    rest[MOMENTS + 7] += x2 * n
                    rest[MOMENTS + 8] += x2 * u
                    rest[MOMENTS + 9] += x3 * e
                    rest[MOMENTS + 10] += x3 * n
                    rest[MOMENTS + 11] += x3 * u
            if where.shape[1]:
                where[i, k] = -1 if moves else int(row[REST])
            for j in range(3):
                row[BEFORE + j] = velocity[i, k, j]
            if sample % size == 0:
                if cells.shape[1]:
                    cell = cells[i, done]
                    whole = row[FILL] == size and row[REST] < RESTS
                    cell[WHERE] = row[REST] if whole else -1.0
                    cell[END] = t
                    cell[MEAN] = row[BLOCK] / size
                    cell[MEAN + 1] = row[BLOCK + 1] / size
                    for j in range(9):
                        cell[J_END + j], cell[TWIST_END + j] = row[J + j], row[TWIST + j]
                    done += 1
                row[BLOCK], row[BLOCK + 1], row[FILL] = 0.0, 0.0, 0.0
