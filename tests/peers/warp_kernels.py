"""Kernels that Warp compiles for the CPU: distances with signs by winding number, and contacts by Frank-Wolfe."""

import warp as wp


@wp.kernel
def distance(body: wp.uint64, points: wp.array(dtype=wp.vec3), farthest: float, out: wp.array(dtype=float)):
    i = wp.tid()
    point = points[i]
    nearest = wp.mesh_query_point_sign_winding_number(body, point, farthest)
    on_body = wp.mesh_eval_position(body, nearest.face, nearest.u, nearest.v)
    out[i] = nearest.sign * wp.length(point - on_body)


@wp.func
def sample(volume: wp.array3d(dtype=float), origin: wp.vec3, inv_spacing: float, point: wp.vec3):
    """Gradient and value of the trilinear interpolant at a point, clamped to the box."""
    local = (point - origin) * inv_spacing
    x = wp.clamp(local[0], 0.0, float(volume.shape[2] - 1))
    y = wp.clamp(local[1], 0.0, float(volume.shape[1] - 1))
    z = wp.clamp(local[2], 0.0, float(volume.shape[0] - 1))
    i = wp.min(int(x), volume.shape[2] - 2)
    j = wp.min(int(y), volume.shape[1] - 2)
    k = wp.min(int(z), volume.shape[0] - 2)
    u = x - float(i)
    v = y - float(j)
    w = z - float(k)
    a = volume[k, j, i]
    b = volume[k, j, i + 1]
    c = volume[k, j + 1, i]
    d = volume[k, j + 1, i + 1]
    e = volume[k + 1, j, i]
    f = volume[k + 1, j, i + 1]
    g = volume[k + 1, j + 1, i]
    h = volume[k + 1, j + 1, i + 1]
    ab = a + (b - a) * u
    cd = c + (d - c) * u
    ef = e + (f - e) * u
    gh = g + (h - g) * u
    low = ab + (cd - ab) * v
    high = ef + (gh - ef) * v
    along_x = ((b - a) * (1.0 - v) + (d - c) * v) * (1.0 - w) + ((f - e) * (1.0 - v) + (h - g) * v) * w
    along_y = (cd - ab) * (1.0 - w) + (gh - ef) * w
    along_z = high - low
    return wp.vec4(along_x * inv_spacing, along_y * inv_spacing, along_z * inv_spacing, low + (high - low) * w)


@wp.kernel
def frank_wolfe(
    points: wp.array(dtype=wp.vec3),
    faces: wp.array(dtype=wp.vec3i),
    volume: wp.array3d(dtype=float),
    origin: wp.vec3,
    spacing: float,
    margin: float,
    slope_bound: float,
    steps: int,
    values: wp.array(dtype=float),
    weights: wp.array(dtype=wp.vec3),
):
    """The lowest value found; 1e30 for a face that the cull at its centroid drops."""
    i = wp.tid()
    face = faces[i]
    a = points[face[0]]
    b = points[face[1]]
    c = points[face[2]]
    inv_spacing = 1.0 / spacing
    middle = (a + b + c) / 3.0
    radius = wp.max(wp.max(wp.length(a - middle), wp.length(b - middle)), wp.length(c - middle))
    at = sample(volume, origin, inv_spacing, middle)
    lowest = at[3]
    lowest_weights = wp.vec3(1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0)
    if lowest > margin + slope_bound * radius:
        values[i] = 1.0e30
        return
    weight = lowest_weights
    for step in range(steps):
        gradient = wp.vec3(at[0], at[1], at[2])
        da = wp.dot(gradient, a)
        db = wp.dot(gradient, b)
        dc = wp.dot(gradient, c)
        corner = wp.vec3(0.0, 0.0, 1.0)
        if da <= db and da <= dc:
            corner = wp.vec3(1.0, 0.0, 0.0)
        elif db <= dc:
            corner = wp.vec3(0.0, 1.0, 0.0)
        step_size = 2.0 / (float(step) + 2.0)
        weight = weight + (corner - weight) * step_size
        at = sample(volume, origin, inv_spacing, a * weight[0] + b * weight[1] + c * weight[2])
        if at[3] < lowest:
            lowest = at[3]
            lowest_weights = weight
    values[i] = lowest
    weights[i] = lowest_weights
