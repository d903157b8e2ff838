"""Divides a mesh's triangles into sixteen each, on a smooth surface: a scan that is much finer than the voxels of its grid.

Loop 1987, "Smooth subdivision surfaces based on triangles", twice: boundaries stay where they are.
"""

import numpy as np


def divide(source, target, times=2):
    """Writes the mesh of `source`, an OBJ file, divided, to `target`."""
    points, triangles = read(source)
    for _ in range(times):
        points, triangles = divided(points, triangles)
    with open(target, "w") as file:
        np.savetxt(file, points, fmt="v %.9g %.9g %.9g")
        np.savetxt(file, triangles + 1, fmt="f %d %d %d")


def read(path):
    """Points, and triangles as indices of three of them; faces with more corners become fans."""
    points, triangles = [], []
    with open(path) as file:
        for words in filter(None, map(str.split, file)):
            if words[0] == "v":
                points.append([float(word) for word in words[1:4]])
            elif words[0] == "f":
                first, *rest = [int(word.split("/")[0]) - 1 for word in words[1:]]
                triangles += [[first, *pair] for pair in zip(rest, rest[1:])]
    return np.array(points), np.array(triangles)


def divided(points, triangles):
    sides = np.concatenate([triangles[:, [corner, (corner + 1) % 3]] for corner in range(3)])
    opposite = np.concatenate([triangles[:, (corner + 2) % 3] for corner in range(3)])
    edges, edge_of_side, uses = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge_of_side, inner = edge_of_side.ravel(), uses == 2
    across = sums(len(edges), edge_of_side, points[opposite])
    middles = points[edges].mean(axis=1)
    middles[inner] = 0.75 * middles[inner] + 0.125 * across[inner]
    both_ways = np.concatenate([edges, edges[:, ::-1]])
    neighbours = sums(len(points), both_ways[:, 0], points[both_ways[:, 1]])
    degree = np.bincount(both_ways[:, 0], minlength=len(points)).clip(1)
    share = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / degree) / 4) ** 2) / degree
    moved = (1 - degree * share)[:, None] * points + share[:, None] * neighbours
    stays = np.isin(np.arange(len(points)), edges[~inner]) | ~np.isin(np.arange(len(points)), triangles)
    moved[stays] = points[stays]
    [ab, bc, ca] = len(points) + edge_of_side.reshape(3, -1)
    [a, b, c] = triangles.T
    parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([moved, middles]), np.concatenate([np.stack(corners, axis=1) for corners in parts])


def sums(count, index, vectors):
    total = np.zeros((count, 3))
    np.add.at(total, index, vectors)
    return total
