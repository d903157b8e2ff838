"""Meshes of the check: points that f32 holds exactly, so that the program and the shader read the same ones."""

import os

import numpy as np

SEED = os.environ.get("SDF_SEED", "1")


class Mesh:
    """Points [n, 3] in f32, faces [n, 3], and the file in which the program finds them.

    The program refuses files with numbers that are not finite, and skips elements with coordinates above 1e150: NaN and infinities
    are written as such.
    """

    def __init__(self, path, points, faces):
        self.path, self.points, self.faces = path, np.asarray(points, "<f4"), np.asarray(faces)
        in_file = np.where(np.isfinite(self.points), self.points.astype(float), 1e200)
        lines = ["v " + " ".join(repr(float(x)) for x in point) for point in in_file]
        lines += ["f " + " ".join(str(vertex + 1) for vertex in face) for face in self.faces]
        path.write_text("\n".join(lines) + "\n")

    @classmethod
    def read(cls, path, rounded_path):
        """The triangles of an OBJ file, rounded to f32 and written to another."""
        rows = [line.split() for line in path.read_text().splitlines()]
        points = [[float(x) for x in row[1:4]] for row in rows if row[:1] == ["v"]]
        faces = [[int(word.split("/")[0]) - 1 for word in row[1:4]] for row in rows if row[:1] == ["f"]]
        return cls(rounded_path, points, faces)

    def elements(self, kind):
        """Faces, edges in the order of their first appearance, or vertices."""
        if kind == "faces":
            return self.faces
        if kind == "vertices":
            return np.arange(len(self.points))[:, None]
        sides = self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        _, first = np.unique(np.sort(sides, axis=1), axis=0, return_index=True)
        return sides[np.sort(first)]


def soup(path, seed, count=2000):
    """Triangles of all sizes in and around the grid of a body of radius 1; some without area, one with a NaN, one infinite."""
    random = np.random.default_rng(seed)
    centre = random.uniform(-1.6, 1.6, (count, 1, 3))
    size = 10.0 ** random.uniform(-4, 0, (count, 1, 1))
    corners = centre + size * random.uniform(-1, 1, (count, 3, 3))
    corners[:20, 2] = corners[:20, 1]
    corners[:10, 1] = corners[:10, 2] = corners[:10, 0]
    corners[20, 1, 2], corners[21, 2, 0] = np.nan, np.inf
    return Mesh(path, corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def rotation_matrix(quaternion):
    """The rotation by x, y, z, w, normalized."""
    x, y, z, w = np.array(quaternion, float) / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
