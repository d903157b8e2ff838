"""Runs the same work by sdftool and by other programs, in turns, on one processor, and writes CSV.

Called by run.sh, which builds what is needed. Every program gets the same mesh and nodes. Building a tree or table from the mesh
counts, reading files does not. Times are medians of up to --rounds runs; a program that has used its --limit seconds for a piece
of work does not run again. Ratios are the program's time over ours in the same session.
"""

import argparse
import csv
import datetime
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import h5py
import numpy as np

from finer import divide

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
HEAD = [
    "date", "machine", "work", "mesh", "triangles", "resolution", "program", "seconds", "least", "rounds", "ratio",
    "error", "wrong_signs", "nodes", "peak_mib", "facts",
]
GROUPS = ["dense", "sparse", "fine", "contacts", "obj", "entangled"]

ORACLE = "libigl fast winding number"

# A program without an answer for this many times its --limit is killed.
PATIENCE = 40


def machine():
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{models[0] if models else 'unknown processor'}; {os.cpu_count()} cores".replace(",", " ")


class Worker:
    """A process that has read its files and works on request."""

    def __init__(self, name, command, limit):
        self.name = name
        self.patience = PATIENCE * limit
        self.seconds = []
        self.facts = {}
        self.failure = ""
        single = {"OMP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self.errors = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            pinned(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors, text=True,
            env={**os.environ, **single},
        )

    def start(self):
        self.answer()

    def answer(self):
        watch = threading.Timer(self.patience, self.process.kill)
        watch.start()
        try:
            for line in self.process.stdout:
                try:
                    return json.loads(line)
                except ValueError:
                    continue
        finally:
            watch.cancel()
        raise RuntimeError(f"ended with {self.process.wait()}: {self.last_words()}")

    def last_words(self):
        self.errors.seek(0)
        lines = [line.strip() for line in self.errors if line.strip()]
        return lines[-1] if lines else "without a message"

    def send(self, line):
        try:
            self.process.stdin.write(line + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            # The last line of its stderr says more.
            pass
        return self.answer()

    def go(self):
        answer = self.send("go")
        self.seconds.append(answer["seconds"])
        self.facts = answer["facts"]

    def distances(self):
        with tempfile.NamedTemporaryFile() as file:
            self.send(f"save {file.name}")
            return np.fromfile(file.name, dtype="<f4")

    def end(self):
        self.process.kill()
        self.process.wait()


class Sdftool:
    """Our program, a new process for each run; `seconds` picks the time from its own report."""

    def __init__(self, name, program, words, seconds, facts):
        self.name, self.command, self.pick_seconds, self.pick_facts = name, [program, *words], seconds, facts
        self.seconds, self.facts, self.failure = [], {}, ""

    def start(self):
        pass

    def go(self):
        said = json.loads(said_by(pinned(self.command)))
        self.seconds.append(self.pick_seconds(said))
        self.facts = self.pick_facts(said)

    def distances(self):
        file = next(Path(word) for word in map(str, self.command) if word.endswith(".h5"))
        with h5py.File(file) as grid:
            return grid["VTKHDF/PointData/distance"][:].ravel()

    def end(self):
        pass


def said_by(command):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or ["without a message"]
        raise RuntimeError(f"ended with {done.returncode}: {lines[-1]}")
    return done.stdout


def pinned(command):
    """The command on the last processor only; TBB and others use one thread there."""
    last = max(os.sched_getaffinity(0))
    return ["taskset", "-c", str(last), *map(str, command)]


class Run:
    def __init__(self, args):
        self.args = args
        self.rows = []
        self.about = [datetime.date.today().isoformat(), machine()]
        self.folder = Path(tempfile.mkdtemp())

    def python(self, program, mesh, query):
        interpreter = "/usr/bin/python3" if program == "openvdb" else sys.executable
        return [interpreter, HERE / "worker.py", program, mesh, json.dumps(query)]

    def rust(self, program, *words):
        return [self.args.peers, program, *words]

    def worker(self, name, command):
        return [Worker(name, command, self.args.limit)]

    def take_turns(self, work, mesh, triangles, resolution, programs, reference=None):
        """Runs `programs`, ours first, in turns. One that fails gets a row that says so, and the others continue."""
        attempt(programs, lambda program: program.start())
        for turn in range(self.args.rounds):
            due = [program for program in programs if turn == 0 or sum(program.seconds) < self.args.limit]
            attempt(due, lambda program: program.go())
        judged = {}
        if reference is not None:
            attempt(programs[1:], lambda program: judged.update({program.name: reference.judge(program.distances())}))
            oracle = [program for program in programs if program.name == ORACLE and not program.failure]
            # Ours as it is timed, judged by an independent program.
            attempt(oracle[:1] and programs[:1], lambda ours: judged.update(
                {ours.name: Reference(oracle[0].distances(), reference.side).judge(ours.distances())}))
        ours = statistics.median(programs[0].seconds) if programs[0].seconds else float("nan")
        for program in programs:
            self.rows.append([*self.about, work, mesh, triangles, resolution, program.name,
                              *self.cells(program, ours, judged.get(program.name, ("", "")), reference)])
            print("  " + " | ".join(str(cell) for cell in self.rows[-1][2:]), flush=True)
        for program in programs:
            program.end()

    def cells(self, program, ours, judged, reference):
        if program.failure:
            return ["", "", 0, "", "", "", "", "", program.failure.replace(",", ";")[:120]]
        seconds = statistics.median(program.seconds)
        facts = dict(program.facts)
        peak = facts.pop("peak_mib", "")
        nodes = facts.pop("nodes", reference.count if reference is not None else "")
        listed = " ".join(f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value}"
                          for name, value in facts.items())
        error, wrong = judged
        return [f"{seconds:.5g}", f"{min(program.seconds):.5g}", len(program.seconds), f"{seconds / ours:.3g}",
                shown(error), wrong, nodes, shown(peak), listed]

    def bake(self, mesh, resolution, *words):
        """Bakes a grid. Returns sdftool's report and the file."""
        file = self.folder / f"{mesh.stem}-{resolution}{''.join(words)}.sdf.h5"
        command = [self.args.sdftool, "bake", mesh, "--res", resolution, "-o", file, "--json", *words]
        return json.loads(said_by(command)), file

    def our_bake(self, mesh, resolution, *words):
        grid = self.folder / "ours.sdf.h5"
        command = ["bake", mesh, "--res", resolution, "-o", grid, "--threads", 1, "--json", *words]
        facts = lambda said: {"peak_mib": said["peak_memory_bytes"] / 2**20, "nodes": said["stored_nodes"]}
        return Sdftool("sdftool", self.args.sdftool, command, lambda said: said["seconds"]["bake"], facts)

    def dense(self, mesh):
        resolution = self.args.res
        said, file = self.bake(mesh, resolution, "--sign", "winding")
        nodes = {name: said[name] for name in ["origin", "spacing", "counts"]}
        reference = Reference.from_grid(file, said)
        file.unlink()
        programs = [self.our_bake(mesh, resolution)]
        programs += self.worker("parry3d", self.rust("parry3d", mesh, json.dumps(nodes)))
        programs += self.worker("mesh_to_sdf", self.rust("mesh_to_sdf", mesh, json.dumps(nodes)))
        for program, name in [("fcpw", "FCPW"), ("pysdf", "pysdf"), ("warp", "Warp winding number"),
                              ("libigl", "libigl fast winding number"), ("open3d", "Open3D")]:
            programs += self.worker(name, self.python(program, mesh, nodes))
        self.take_turns("dense", mesh.stem, said["triangles"], resolution, programs, reference)

    def sparse(self, mesh, work="sparse ±3", resolutions=(256, 512)):
        for resolution in resolutions:
            said, file = self.bake(mesh, resolution, "--layout", "sparse")
            file.unlink()
            lattice = {name: said[name] for name in ["origin", "spacing"]}
            programs = [self.our_bake(mesh, resolution, "--layout", "sparse", "--band", 3)]
            # One node suffices: the program chooses its own.
            programs += self.worker("OpenVDB meshToLevelSet", self.python("openvdb", mesh, {**lattice, "counts": [1, 1, 1]}))
            if (work, resolution) == ("sparse ±3", 256):
                # Two minutes at 512.
                programs += self.worker("PhysX 5.3 (SAPIEN)", self.python("physx", mesh, {**lattice, "counts": [1, 1, 1]}))
            self.take_turns(work, mesh.stem, said["triangles"], resolution, programs)

    def fine(self, mesh):
        finer = self.folder / mesh.name
        divide(mesh, finer)
        self.sparse(finer, "sparse ±3 fine", [256])
        finer.unlink()

    def contacts(self, cloth, body):
        said, file = self.bake(body, 256)
        margin = 0.01
        # In one process, the median after a first run, as Warp's kernel is timed; and as one command.
        in_process = lambda method: Sdftool(
            f"sdftool {method}", self.args.speed,
            ["--only", "contacts", "--mesh", cloth, "--field", file, "--margin", margin, "--method", method, "--json"],
            lambda said: next(row["seconds"] for row in said["rows"] if row["threads"] == 1),
            lambda said: next({"faces": row["found"]} for row in said["rows"] if row["threads"] == 1),
        )
        one_command = Sdftool(
            "sdftool fw: one command", self.args.sdftool,
            ["contacts", cloth, file, "--margin", margin, "--method", "fw", "--threads", 1, "--json"],
            lambda said: said["seconds"]["query"],
            lambda said: {"passed_cull": said["passed_cull"], "faces": len(said["contacts"])},
        )
        programs = [in_process("fw"), in_process("auto"), in_process("sample64"), one_command]
        field = {"file": str(file), "margin": margin, "slope_bound": said["slope_bound"]}
        programs += self.worker("Warp kernel; 32 Frank-Wolfe steps", self.python("warp_frank_wolfe", cloth, field))
        programs += self.worker("MuJoCo; 32 steps", self.python("mujoco", cloth, {"body": str(body)}))
        programs += self.worker("parry3d triangle pairs", self.rust("parry3d-pairs", cloth, body, margin))
        self.take_turns("contacts", f"{cloth.stem} on {body.stem}", "", 256, programs)
        file.unlink()

    def obj(self):
        file = self.folder / "sheet.obj"
        said_by(self.rust("write-obj", self.args.obj_triangles, file))
        mib = file.stat().st_size / 1e6
        programs = self.worker("sdf-formats", self.rust("sdf-formats", file)) + self.worker("tobj", self.rust("tobj", file))
        self.take_turns(f"OBJ of {mib:.0f} MB", "sheet", self.args.obj_triangles, "", programs)
        file.unlink()

    def entangled(self):
        said_by(self.rust("entangled", self.args.output / "entangled.csv"))

    def write(self):
        """Keeps the rows of work that was not repeated."""
        path = self.args.output / "peers.csv"
        done = {(row[2], row[3], str(row[5])) for row in self.rows}
        kept = []
        if path.exists():
            with open(path, newline="") as file:
                kept = [row for row in list(csv.reader(file))[1:] if (row[2], row[3], row[5]) not in done]
        with open(path, "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(HEAD)
            writer.writerows(sorted(kept + self.rows, key=lambda row: (row[2], row[3], str(row[5]))))


class Reference:
    """Exact distances with the sign of the winding number, as sdftool bakes them. Agreement of others shows that both are right."""

    def __init__(self, distances, side):
        self.distances, self.side, self.count = distances, side, len(distances)

    @classmethod
    def from_grid(cls, file, said):
        with h5py.File(file) as grid:
            distances = grid["VTKHDF/PointData/distance"][:].ravel()
        cells = [count - 1 for count in said["counts"]]
        # The longest side of the mesh's box, without the padding.
        return cls(distances, max(cells) * said["spacing"] - 2 * said["padding"])

    def judge(self, distances):
        error = np.nanmax(np.abs(np.abs(distances) - np.abs(self.distances))) / self.side
        # NaN has no sign.
        wrong = ((distances < 0) != (self.distances < 0)) | np.isnan(distances)
        return error, int(wrong.sum())


def attempt(programs, what):
    """Applies `what`. A program that fails keeps the reason and is skipped from then on."""
    for program in [program for program in programs if not program.failure]:
        try:
            what(program)
        except Exception as error:
            # Without folder names of this machine.
            program.failure = "failed: " + re.sub(r"[^\s'\"]*/", "", str(error) or type(error).__name__)
            print(f"  {program.name}: {program.failure}", flush=True)


def shown(number):
    return number if isinstance(number, str) else f"{number:.3g}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdftool", required=True, type=Path)
    parser.add_argument("--speed", required=True, type=Path, help="the program that measures contacts in one process")
    parser.add_argument("--peers", required=True, type=Path)
    parser.add_argument("--meshes", required=True, type=Path, help="a folder with the meshes to bake, as OBJ")
    parser.add_argument("--names", default="stanford-bunny,armadillo,dragon", help="which of them")
    parser.add_argument("--shells", default="cow,teapot", help="more of them, of shells that cross or are open, for sparse grids alone")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "performance")
    parser.add_argument("--only", default=",".join(GROUPS), help=f"of {', '.join(GROUPS)}")
    parser.add_argument("--res", type=int, default=128, help="of dense grids")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--limit", type=float, default=15.0, help="seconds for each program in each piece of work")
    parser.add_argument("--obj-triangles", type=int, default=3_400_000)
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    run = Run(args)
    only = args.only.split(",")
    of_names = lambda names: [mesh for name in names.split(",") if (mesh := args.meshes / f"{name}.obj").exists()]
    meshes, shells = of_names(args.names), of_names(args.shells)
    cloth, body = args.meshes / "cloth.obj", args.meshes / "dragon.obj"
    work = {
        "dense": lambda: [run.dense(mesh) for mesh in meshes],
        "sparse": lambda: [run.sparse(mesh) for mesh in [*meshes, *shells]],
        "fine": lambda: [run.fine(mesh) for mesh in meshes],
        "contacts": lambda: run.contacts(cloth, body) if cloth.exists() and body.exists() else None,
        "obj": run.obj,
        "entangled": run.entangled,
    }
    for group in [group for group in GROUPS if group in only]:
        print(f"== {group}", flush=True)
        try:
            work[group]()
        except (RuntimeError, OSError, ValueError, subprocess.CalledProcessError) as error:
            print(f"  the rest of {group} is left out: {error}", flush=True)
        run.write()
    run.folder.rmdir() if not any(run.folder.iterdir()) else subprocess.run(["rm", "-r", str(run.folder)], check=False)


if __name__ == "__main__":
    main()
