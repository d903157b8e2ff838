"""Runs the same work through sdftool and through other programs, in turns, on one processor, and writes CSV.

Called by run.sh, which builds what is needed. Every program gets the same mesh and the same nodes; a tree or table that it
builds of the mesh counts, reading files does not. Medians of up to --rounds times; a program that has had its --limit seconds
for a piece of work is not asked again. Ratios are of the program's time over ours in the same run.
"""

import argparse
import csv
import datetime
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
HEAD = [
    "date", "machine", "work", "mesh", "triangles", "resolution", "program", "seconds", "least", "rounds", "ratio",
    "error", "wrong_signs", "nodes", "peak_mib", "facts",
]
GROUPS = ["dense", "sparse", "contacts", "obj", "entangled"]


def machine():
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{models[0] if models else 'unknown processor'}; {os.cpu_count()} cores".replace(",", " ")


class Worker:
    """A process that has read its files and does its work when told."""

    def __init__(self, name, command):
        self.name = name
        self.seconds = []
        self.facts = {}
        single = {"OMP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            pinned(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env={**os.environ, **single},
        )
        self.answer()

    def answer(self):
        for line in self.process.stdout:
            try:
                return json.loads(line)
            except ValueError:
                continue
        raise RuntimeError(f"{self.name} ended")

    def tell(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.answer()

    def go(self):
        answer = self.tell("go")
        self.seconds.append(answer["seconds"])
        self.facts = answer["facts"]

    def distances(self):
        with tempfile.NamedTemporaryFile() as file:
            self.tell(f"save {file.name}")
            return np.fromfile(file.name, dtype="<f4")

    def end(self):
        self.process.kill()
        self.process.wait()


class Sdftool:
    """Our program, run anew each time; `seconds` picks the time out of what it says of itself."""

    def __init__(self, name, program, words, seconds, facts):
        self.name, self.command, self.pick, self.tell_facts = name, [program, *words], seconds, facts
        self.seconds, self.facts = [], {}

    def go(self):
        said = json.loads(subprocess.run(pinned(self.command), capture_output=True, text=True, check=True).stdout)
        self.seconds.append(self.pick(said))
        self.facts = self.tell_facts(said)

    def end(self):
        pass


def pinned(command):
    """On the last processor, so that nothing runs on two; TBB and others take one thread there."""
    last = max(os.sched_getaffinity(0))
    return ["taskset", "-c", str(last), *map(str, command)]


class Run:
    def __init__(self, args):
        self.args = args
        self.rows = []
        self.about = [datetime.date.today().isoformat(), machine()]
        self.folder = Path(tempfile.mkdtemp())

    def python(self, program, mesh, asked):
        interpreter = "/usr/bin/python3" if program == "openvdb" else sys.executable
        return [interpreter, HERE / "worker.py", program, mesh, json.dumps(asked)]

    def rust(self, program, *words):
        return [self.args.peers, program, *words]

    def started(self, name, command):
        try:
            return [Worker(name, command)]
        except (RuntimeError, OSError) as error:
            print(f"  {name}: left out: {error}", flush=True)
            return []

    def take_turns(self, work, mesh, triangles, resolution, programs, reference=None):
        """`programs` has ours first."""
        for turn in range(self.args.rounds):
            for program in programs:
                if turn == 0 or sum(program.seconds) < self.args.limit:
                    try:
                        program.go()
                    except (RuntimeError, OSError, subprocess.CalledProcessError) as error:
                        print(f"  {program.name}: failed: {error}", flush=True)
        ours = programs[0]
        for program in [program for program in programs if program.seconds]:
            seconds = statistics.median(program.seconds)
            ratio = seconds / statistics.median(ours.seconds)
            error, wrong = (program.facts.pop("error", ""), program.facts.pop("wrong_signs", ""))
            if reference is not None and isinstance(program, Worker):
                error, wrong = reference.judge(program.distances())
            peak = program.facts.pop("peak_mib", "")
            nodes = program.facts.pop("nodes", reference.count if reference is not None else "")
            facts = " ".join(f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value}"
                             for name, value in program.facts.items())
            row = [work, mesh, triangles, resolution, program.name, f"{seconds:.5g}", f"{min(program.seconds):.5g}",
                   len(program.seconds), f"{ratio:.3g}", shown(error), wrong, nodes, shown(peak), facts]
            self.rows.append([*self.about, *row])
            print("  " + " | ".join(str(cell) for cell in row), flush=True)
        for program in programs:
            program.end()

    def bake(self, mesh, resolution, *words):
        """What sdftool says of a grid that it writes, and where it lies."""
        file = self.folder / f"{mesh.stem}-{resolution}{''.join(words)}.sdf.h5"
        command = [self.args.sdftool, "bake", mesh, "--res", resolution, "-o", file, "--json", *words]
        said = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True).stdout
        return json.loads(said), file

    def our_bake(self, mesh, resolution, *words):
        grid = self.folder / "ours.sdf.h5"
        command = ["bake", mesh, "--res", resolution, "-o", grid, "--threads", 1, "--json", *words]
        facts = lambda said: {"peak_mib": said["peak_memory_bytes"] / 2**20, "nodes": said["stored_nodes"]}
        return Sdftool("sdftool", self.args.sdftool, command, lambda said: said["seconds"]["bake"], facts)

    def dense(self, mesh):
        resolution = self.args.res
        said, file = self.bake(mesh, resolution, "--sign", "winding")
        nodes = {name: said[name] for name in ["origin", "spacing", "counts"]}
        reference = Reference(file, said)
        file.unlink()
        programs = [self.our_bake(mesh, resolution)]
        programs += self.started("parry3d", self.rust("parry3d", mesh, json.dumps(nodes)))
        programs += self.started("mesh_to_sdf", self.rust("mesh_to_sdf", mesh, json.dumps(nodes)))
        for program, name in [("fcpw", "FCPW"), ("pysdf", "pysdf"), ("warp", "Warp winding number"),
                              ("libigl", "libigl fast winding number"), ("open3d", "Open3D")]:
            programs += self.started(name, self.python(program, mesh, nodes))
        self.take_turns("dense", mesh.stem, said["triangles"], resolution, programs, reference)

    def sparse(self, mesh):
        for resolution in [256, 512]:
            said, file = self.bake(mesh, resolution, "--layout", "sparse")
            file.unlink()
            asked = {name: said[name] for name in ["origin", "spacing"]}
            programs = [self.our_bake(mesh, resolution, "--layout", "sparse", "--band", 3)]
            programs += self.started("OpenVDB meshToLevelSet", self.python_of_field("openvdb", mesh, asked))
            self.take_turns("sparse ±3", mesh.stem, said["triangles"], resolution, programs)

    def python_of_field(self, program, mesh, asked):
        # Nodes of one point: the program makes its own.
        if program == "openvdb":
            asked = {**asked, "counts": [1, 1, 1]}
        return self.python(program, mesh, asked)

    def contacts(self, cloth, body):
        said, file = self.bake(body, 256)
        margin = 0.01
        # In one process, its median after a first time, as Warp's kernel is timed; and as one command.
        in_process = lambda method: Sdftool(
            f"sdftool {method}", self.args.sdftool,
            ["bench", "--only", "contacts", "--mesh", cloth, "--field", file, "--margin", margin, "--method", method, "--json"],
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
        programs += self.started("Warp kernel; 32 Frank-Wolfe steps", self.python("warp_frank_wolfe", cloth, field))
        programs += self.started("parry3d triangle pairs", self.rust("parry3d-pairs", cloth, body, margin))
        self.take_turns("contacts", f"{cloth.stem} on {body.stem}", "", 256, programs)
        file.unlink()

    def obj(self):
        file = self.folder / "sheet.obj"
        subprocess.run(self.rust("write-obj", str(self.args.obj_triangles), file), check=True)
        mib = file.stat().st_size / 1e6
        programs = self.started("sdf-formats", self.rust("sdf-formats", file)) + self.started("tobj", self.rust("tobj", file))
        self.take_turns(f"OBJ of {mib:.0f} MB", "sheet", self.args.obj_triangles, "", programs)
        file.unlink()

    def entangled(self):
        subprocess.run(list(map(str, self.rust("entangled", self.args.output / "entangled.csv"))), check=True)

    def write(self):
        """Keeps the rows of work that was not done this time."""
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
    """Exact distances with the sign of the winding number, as sdftool bakes them; that others agree shows both right."""

    def __init__(self, file, said):
        with h5py.File(file) as grid:
            self.distances = grid["VTKHDF/PointData/distance"][:].ravel()
        self.count = len(self.distances)
        cells = [count - 1 for count in said["counts"]]
        # The longest side of the mesh's box, without the padding.
        self.side = max(cells) * said["spacing"] - 2 * said["padding"]

    def judge(self, distances):
        off = np.nanmax(np.abs(np.abs(distances) - np.abs(self.distances))) / self.side
        # What is no number has no sign.
        wrong = ((distances < 0) != (self.distances < 0)) | np.isnan(distances)
        return off, int(wrong.sum())


def shown(number):
    return number if isinstance(number, str) else f"{number:.3g}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdftool", required=True, type=Path)
    parser.add_argument("--peers", required=True, type=Path)
    parser.add_argument("--meshes", required=True, type=Path, help="a folder with the meshes to bake, as OBJ")
    parser.add_argument("--names", default="stanford-bunny,armadillo,dragon", help="which of them")
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
    meshes = [args.meshes / f"{name}.obj" for name in args.names.split(",")]
    meshes = [mesh for mesh in meshes if mesh.exists()]
    cloth, body = args.meshes / "cloth.obj", args.meshes / "dragon.obj"
    work = {
        "dense": lambda: [run.dense(mesh) for mesh in meshes],
        "sparse": lambda: [run.sparse(mesh) for mesh in meshes],
        "contacts": lambda: run.contacts(cloth, body) if cloth.exists() and body.exists() else None,
        "obj": run.obj,
        "entangled": run.entangled,
    }
    for group in [group for group in GROUPS if group in only]:
        print(f"== {group}", flush=True)
        work[group]()
        run.write()
    run.folder.rmdir() if not any(run.folder.iterdir()) else subprocess.run(["rm", "-r", str(run.folder)], check=False)


if __name__ == "__main__":
    main()
