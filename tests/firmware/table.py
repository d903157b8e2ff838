"""The table of docs/firmware.md: links each function of the crate `sizes` alone and measures what is left.

    python3 table.py NAME=LIBRARY ... < lines of the queries, one a line
    python3 table.py --check LIBRARY < the same    # fails if a query can panic, or has doubles that it should not have

Code is .text and .rodata, those of the compiler's own routines (soft float, memcpy) apart. Stack is the deepest sum of frames along
calls, from the frame sizes that the compiler writes (-Z emit-stack-sizes) and the calls in the disassembly: none is recursive, and
none goes through a pointer, which is checked.
"""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

PANIC = re.compile("panic")
ROUTINE = re.compile(r"compiler_builtins|^__|^mem(cpy|set|move|cmp|clr)")
# Proofs and bounds are in double, as is the slope bound of an empty slot of a sparse grid, which the cull of a whole contact asks for.
MAY_HAVE_DOUBLES = re.compile(r"certified|`contact`|`lean_contact`\.sparse")
DOUBLE = re.compile(r"__aeabi_(d|[a-z0-9]+2d)|__\w+df|__\w*df\w*[23]$|__(adddf|subdf|muldf|divdf)3|__truncdfsf2|__extendsfdf2")


def tool(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


class Program:
    """A query, linked alone."""

    def __init__(self, library, query, folder):
        self.elf = str(Path(folder) / "query.elf")
        tool("ld.lld-22", "--gc-sections", "-e", query, "-u", query, "-o", self.elf, library)
        self.symbols = {}
        for line in tool("llvm-nm-22", "--print-size", "--demangle", self.elf).splitlines():
            found = re.match(r"([0-9a-f]+) ([0-9a-f]+) (\w) (.*)", line)
            if found:
                address, size, kind, name = found.groups()
                # Aliases stand at one address.
                self.symbols.setdefault(int(address, 16) & ~1, []).append((int(size, 16), kind, name))
        self.query = query
        if not any(name == query for names in self.symbols.values() for _, _, name in names):
            sys.exit(f"{query}: not in {library}")

    def bytes(self):
        """Code and constants of the query, and of the compiler's routines."""
        total = 0
        for line in tool("llvm-size-22", "-A", self.elf).splitlines():
            found = re.match(r"\.(text|rodata)\S*\s+(\d+)", line)
            total += int(found[2]) if found else 0
        routines = sum(
            max(size for size, _, _ in names)
            for names in self.symbols.values()
            if any(kind in "tTrRwW" and ROUTINE.search(name) for _, kind, name in names)
        )
        return total - routines, routines

    def has(self, pattern):
        return any(pattern.search(name) for names in self.symbols.values() for _, _, name in names)

    def stack(self):
        frames, frame_of = {}, None
        for line in tool("llvm-readobj-22", "--stack-sizes", self.elf).splitlines():
            if found := re.match(r"\s*Functions: \[(.*)\]", line):
                frame_of = found[1]
            elif found := re.match(r"\s*Size: (0x[0-9a-fA-F]+)", line):
                for name in frame_of.split(", ") + [frame_of]:
                    frames[name] = int(found[1], 16)
        calls, function, starts = {}, None, {}
        for line in tool("llvm-objdump-22", "-d", "--no-show-raw-insn", self.elf).splitlines():
            if found := re.match(r"([0-9a-f]+) <(.*)>:$", line):
                function = found[2]
                calls.setdefault(function, set())
                starts[int(found[1], 16)] = function
            elif function and (re.search(r"\tblx\tr\d", line) or (re.search(r"\tjalr\t", line) and "<" not in line)):
                sys.exit(f"{self.query}: {function} calls through a pointer")
            elif function and (found := re.search(r"(?:0x[0-9a-f]+|\((?:ra|t1)\)) <([^+>]*)>", line)):
                calls[function].add(found[1])

        def depth(name, above):
            if name in above:
                sys.exit(f"{self.query}: {name} is recursive")
            below = [depth(callee, above | {name}) for callee in calls.get(name, ()) if callee in calls and callee != name]
            return frames.get(name, 0) + max(below, default=0)

        return depth(self.query, frozenset())


def cell(library, query, folder):
    program = Program(library, query, folder)
    code, routines = program.bytes()
    marks = (" f64" if program.has(DOUBLE) else "") + (" panic" if program.has(PANIC) else "")
    return f"{code:,}{f' + {routines:,}' if routines else ''} / {program.stack():,}{marks}"


def check(library):
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        queries = sys.stdin.read().splitlines()
        for query in queries:
            program = Program(library, query, folder)
            if program.has(PANIC):
                faults.append(f"{query}: can panic")
            if program.has(DOUBLE) and not MAY_HAVE_DOUBLES.search(query):
                faults.append(f"{query}: computes in double")
    sys.exit("\n".join(faults) or None if queries else "no query to check")


def main():
    if sys.argv[1] == "--check":
        check(sys.argv[2])
    targets = [argument.split("=", 1) for argument in sys.argv[1:]]
    print("| query | field | element |", " | ".join(name for name, _ in targets), "|")
    print("|---|---|---|" + "---|" * len(targets))
    with tempfile.TemporaryDirectory() as folder:
        for query in sys.stdin.read().splitlines():
            cells = [cell(library, query, folder) for _, library in targets]
            print("|", " | ".join(query.split(".") + cells), "|")


main()
