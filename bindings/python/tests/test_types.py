"""The stub, as a type checker reads it."""

import sys

import pytest

CALLS = """
import numpy as np
import numpy.typing as npt
import sdftool

def ask(field: sdftool.Sdf, query: sdftool.CudaQuery, vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.uint32], flag: bool) -> None:
    plain: npt.NDArray[np.void] = field.contacts(vertices, faces)
    counted, counts = field.contacts(vertices, faces, counts=True)
    found = field.contacts(vertices, faces, counts=flag)
    contacts = found[0] if isinstance(found, tuple) else found
    of_frame = query.contacts(counts=flag)
    values, gradients = field.sample(vertices)
    values, gradients, status = field.sample(vertices, status=True)
    samples = field.sample(vertices, status=flag)
    values = samples[0]
    joined: sdftool.Sdf = (field | field) & field - field
    field.contacts(vertices, faces, counts=3)
"""


def test_flags_may_be_variables(tmp_path):
    api = pytest.importorskip("mypy.api")
    calls = tmp_path / "calls.py"
    calls.write_text(CALLS)
    said, _, _ = api.run(["--strict", "--cache-dir", str(tmp_path / "cache"), "--python-executable", sys.executable, str(calls)])
    errors = [line for line in said.splitlines() if ": error:" in line]
    # The last line is wrong on purpose: the stub is read.
    assert len(errors) == 1 and f":{len(CALLS.splitlines())}: error: No overload" in errors[0], said
