"""A gallery page: bake a body, slice it, drape a cloth over it, and show the contacts. python gallery.py FOLDER

Needs trimesh. Writes FOLDER/index.html with its pictures and FOLDER/scene.glb, a scene for any viewer of glTF.
"""

import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import sdftool
import trimesh


def png(path, pixels):
    """Writes an array (rows, columns, 3) of uint8."""
    rows, columns, _ = pixels.shape
    data = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    header = struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b""))


def body():
    """A ball with bumps and dents."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    x, y, z = ball.vertices.T
    ball.vertices *= (0.8 + 0.2 * np.sin(5 * x) * np.sin(4 * y + 1) * np.cos(3 * z))[:, None]
    return ball


def cloth(cells=60):
    steps = np.linspace(-1.1, 1.1, cells + 1)
    x, y = np.meshgrid(steps, steps)
    vertices = np.stack([x, y, 0.66 - 0.4 * (x * x + y * y)], axis=-1).reshape(-1, 3)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    halves = [[corner, corner + 1, corner + cells + 2], [corner, corner + cells + 2, corner + cells + 1]]
    return trimesh.Trimesh(vertices, np.concatenate([np.stack(half, axis=-1) for half in halves]), process=False)


def slice_picture(field, size=480, half=1.4):
    """The plane y = 0: blue inside, with lines every 0.1."""
    steps = (np.arange(size) + 0.5) / size * 2 * half - half
    x, z = np.meshgrid(steps, -steps)
    distance = field(np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)).reshape(size, size)
    shade = 0.5 + 0.5 * np.clip(np.abs(distance) / half, 0, 1)
    colour = np.where(distance[..., None] < 0, [60, 110, 200], [240, 225, 200]) * (1.3 - 0.6 * shade[..., None])
    colour[np.abs(distance / 0.1 - np.round(distance / 0.1)) < 0.04] *= 0.8
    colour[np.abs(distance) < 0.008] = 0
    return np.clip(colour, 0, 255).astype(np.uint8)


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    solid, sheet = body(), cloth()
    field = sdftool.bake(solid, res=128, layout="sparse", band=16)
    png(folder / "slice.png", slice_picture(field))

    contacts = field.contacts(sheet, margin=0.02)
    deep = np.clip(-contacts["distance"] / max(-contacts["distance"].min(), 1e-9), 0, 1)
    colours = np.stack([255 * deep, 255 * (1 - deep), np.zeros_like(deep), np.full_like(deep, 255)], axis=-1).astype(np.uint8)
    scene = trimesh.Scene({"body": solid, "cloth": sheet, "contacts": trimesh.PointCloud(contacts["point"], colours)})
    scene.export(folder / "scene.glb")

    by_status = {name: int((contacts["status"] == code).sum()) for code, name in enumerate(sdftool.STATUS_NAMES)}
    deepest = contacts[contacts["distance"].argmin()]
    rows = {
        "field": repr(field),
        "sign": field.sign_reason,
        "contacts": f"{len(contacts)} of {len(sheet.faces)} faces",
        "status": ", ".join(f"{count} {name}" for name, count in by_status.items() if count),
        "deepest": f"{deepest['distance']:.6f} at face {deepest['id']}, proven above {deepest['lower_bound']:.6f}",
    }
    cells = "".join(f"<tr><th>{name}<td>{text.replace('<', '&lt;')}" for name, text in rows.items())
    style = "body{font:16px sans-serif;max-width:50em;margin:2em auto}th{text-align:left;padding-right:1em}img{max-width:100%}"
    page = f"<!doctype html><meta charset=utf-8><title>sdftool</title><style>{style}</style><h1>A body, a slice, a cloth</h1>"
    page += f"<img src=slice.png alt='A slice through the body'><table>{cells}</table><a href=scene.glb>scene.glb</a>\n"
    (folder / "index.html").write_text(page)
    print(rows["contacts"], "-", folder / "index.html")
    assert len(contacts) > 100 and by_status["converged"] > 0.9 * len(contacts)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "gallery"))
