"""Bias at a flat skin of four ways to make radiance of photons: python3 tools/eq8.py

Light falls straight onto the half space x > 0 and is seen from straight above; one scattering. Lengths are in radii of the
gather, of which a ball has the weight 3/4 (1 - x^2) across. Printed is radiance over the true one, by optical radius."""

import math

STEPS = 400


def integral(f, a, b):
    h = (b - a) / STEPS
    return h * sum(f(a + (i + 0.5) * h) for i in range(STEPS)) if b > a else 0.0


def ratios(sigma):
    kernel = lambda x: 0.75 * (1 - x * x)
    fluence = lambda y: math.exp(-sigma * y)

    def moment(q, power, weight):
        return integral(lambda y: kernel(y - q) * (y - q) ** power * weight(y), max(q - 1, 0), q + 1)

    def seen(estimate):
        depth = 12 / sigma
        return 2 * integral(lambda q: sigma * math.exp(-sigma * q) * estimate(q), 0, depth)

    one = lambda y: 1.0

    def fit(q):
        # The ball is flattened where matter leans to one side and is dense.
        lean = abs(moment(q, 1, one) / moment(q, 0, one))
        h = 1 - min(lean / 0.1, 1) * (1 - min(1.5 / sigma, 1))
        low, high = max(q - h, 0), q + h

        def flat(power, weight):
            return integral(lambda y: kernel((y - q) / h) / h * (y - q) ** power * weight(y), low, high)

        m0, m1, m2 = (flat(power, one) for power in range(3))
        c = m1 / (m2 + 0.02 * h * h)
        c *= 0.75 * m0 / max(c * m1, 0.75 * m0)
        return (flat(0, fluence) - c * flat(1, fluence)) / (m0 - c * m1)

    photon = seen(lambda q: moment(q, 0, fluence))
    mean = seen(lambda q: moment(q, 0, fluence) / moment(q, 0, one))
    collisions = lambda q: sigma * moment(q, 0, fluence)
    query = 2 * (integral(collisions, -1, 0) + integral(lambda q: math.exp(-sigma * q) * collisions(q), 0, 12 / sigma))
    return photon, query, mean, seen(fit)


print("optical radius  at the photon  at the query point  mean extinction  linear fit")
for sigma in (0.1, 0.25, 0.5, 1, 2, 4):
    print(f"{sigma:14}  {'  '.join(f'{x:13.3f}' for x in ratios(sigma))}")
