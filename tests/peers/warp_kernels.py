"""Kernels of Warp: distances with signs by winding number, and contacts by Frank-Wolfe or at points."""

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


@wp.func
def is_far(a: wp.vec3, b: wp.vec3, c: wp.vec3, middle: wp.vec3, value: float, margin: float, slope_bound: float):
    """Is the face beyond the margin, by the value at its centroid?"""
    radius = wp.max(wp.max(wp.length(a - middle), wp.length(b - middle)), wp.length(c - middle))
    return value > margin + slope_bound * radius


@wp.func
def descend(
    a: wp.vec3,
    b: wp.vec3,
    c: wp.vec3,
    start: wp.vec3,
    first: wp.vec4,
    volume: wp.array3d(dtype=float),
    origin: wp.vec3,
    inv_spacing: float,
    steps: int,
    shift: float,
):
    """The lowest value and its weights, by steps of length 2 / (k + shift) from the weights `start`, whose sample is `first`."""
    at = first
    lowest = at[3]
    lowest_weights = start
    weight = start
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
        step_size = 2.0 / (float(step) + shift)
        weight = weight + (corner - weight) * step_size
        at = sample(volume, origin, inv_spacing, a * weight[0] + b * weight[1] + c * weight[2])
        if at[3] < lowest:
            lowest = at[3]
            lowest_weights = weight
    return lowest, lowest_weights


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
    at = sample(volume, origin, inv_spacing, middle)
    if is_far(a, b, c, middle, at[3], margin, slope_bound):
        values[i] = 1.0e30
        return
    start = wp.vec3(1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0)
    value, weight = descend(a, b, c, start, at, volume, origin, inv_spacing, steps, 2.0)
    values[i] = value
    weights[i] = weight


@wp.func
def report(
    element: int,
    point: wp.vec3,
    volume: wp.array3d(dtype=float),
    origin: wp.vec3,
    inv_spacing: float,
    count: wp.array(dtype=int),
    elements: wp.array(dtype=int),
    distances: wp.array(dtype=float),
    contact_points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
):
    """Appends a contact at a point."""
    at = sample(volume, origin, inv_spacing, point)
    slot = wp.atomic_add(count, 0, 1)
    if slot < elements.shape[0]:
        elements[slot] = element
        distances[slot] = at[3]
        contact_points[slot] = point
        normals[slot] = wp.normalize(wp.vec3(at[0], at[1], at[2]))


@wp.kernel(enable_backward=False)
def frank_wolfe_contacts(
    points: wp.array(dtype=wp.vec3),
    faces: wp.array(dtype=wp.vec3i),
    volume: wp.array3d(dtype=float),
    origin: wp.vec3,
    spacing: float,
    margin: float,
    slope_bound: float,
    steps: int,
    count: wp.array(dtype=int),
    elements: wp.array(dtype=int),
    distances: wp.array(dtype=float),
    contact_points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
):
    """One contact for each face within the margin, in no order, by our rule: from the lowest corner, first step 2 / 3."""
    i = wp.tid()
    face = faces[i]
    a = points[face[0]]
    b = points[face[1]]
    c = points[face[2]]
    inv_spacing = 1.0 / spacing
    middle = (a + b + c) / 3.0
    if is_far(a, b, c, middle, sample(volume, origin, inv_spacing, middle)[3], margin, slope_bound):
        return
    at = sample(volume, origin, inv_spacing, a)
    start = wp.vec3(1.0, 0.0, 0.0)
    other = sample(volume, origin, inv_spacing, b)
    if other[3] < at[3]:
        at = other
        start = wp.vec3(0.0, 1.0, 0.0)
    other = sample(volume, origin, inv_spacing, c)
    if other[3] < at[3]:
        at = other
        start = wp.vec3(0.0, 0.0, 1.0)
    value, weight = descend(a, b, c, start, at, volume, origin, inv_spacing, steps, 3.0)
    if value <= margin:
        point = a * weight[0] + b * weight[1] + c * weight[2]
        report(i, point, volume, origin, inv_spacing, count, elements, distances, contact_points, normals)


@wp.kernel(enable_backward=False)
def point_contacts(
    points: wp.array(dtype=wp.vec3),
    volume: wp.array3d(dtype=float),
    origin: wp.vec3,
    spacing: float,
    margin: float,
    count: wp.array(dtype=int),
    elements: wp.array(dtype=int),
    distances: wp.array(dtype=float),
    contact_points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
):
    """One contact for each vertex within the margin, in no order: the paper's "simple"."""
    i = wp.tid()
    point = points[i]
    inv_spacing = 1.0 / spacing
    at = sample(volume, origin, inv_spacing, point)
    if at[3] <= margin:
        report(i, point, volume, origin, inv_spacing, count, elements, distances, contact_points, normals)
