"""Time that a call from Python takes beside the search itself: python overhead.py

The fixed cost is that of a call with one face. What conversions cost is the difference between faces of int64 and of uint32, points
of float32 and of float64. CPU time of one thread, the best of many rounds in turns.
"""

import time

import numpy as np
import sdftool
from gallery import body, cloth


def best(calls, rounds=25):
    times = [[] for _ in calls]
    for _ in range(rounds):
        for call, taken in zip(calls, times):
            start = time.process_time()
            call()
            taken.append(time.process_time() - start)
    return [min(taken) for taken in times]


field, sheet = sdftool.bake(body(), res=128, threads=1), cloth(140)
points, faces = np.ascontiguousarray(sheet.vertices), sheet.faces.astype(np.uint32)
many = np.random.default_rng(1).uniform(-1, 1, (200_000, 3))
few = lambda: [field.contacts(points[:3], [[0, 1, 2]], threads=1) for _ in range(1000)]
contacts = lambda p, f: lambda: field.contacts(p, f, threads=1)
narrow, wide, single, fixed, sampled, valued = best(
    [
        contacts(points, faces),
        contacts(points, faces.astype(np.int64)),
        contacts(points.astype(np.float32), faces),
        few,
        lambda: field.sample(many, threads=1),
        lambda: field(many, threads=1),
    ]
)
print(f"{len(faces)} faces, {len(field.contacts(points, faces))} contacts: {narrow * 1e3:.2f} ms")
print(f"faces of int64: {(wide - narrow) / narrow:+.1%}; points of float32: {(single - narrow) / narrow:+.1%}")
print(f"a call with one face, from lists: {fixed * 1e3:.1f} µs, {fixed / 1000 / narrow:.2%} of the above")
print(f"a sample with gradient: {sampled / len(many) * 1e9:.0f} ns; a value: {valued / len(many) * 1e9:.0f} ns")
