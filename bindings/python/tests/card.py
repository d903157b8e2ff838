"""Another program of the same card: arrays in the memory of the driver that gpu/stub is, with the CUDA array interface."""

import ctypes

import numpy as np


def driver():
    """The library that sdftool loads under this name, too."""
    library = ctypes.CDLL("libcuda.so")
    library.cuMemAlloc_v2.argtypes = [ctypes.POINTER(ctypes.c_uint64), ctypes.c_size_t]
    library.cuMemFree_v2.argtypes = [ctypes.c_uint64]
    library.cuMemcpyHtoDAsync_v2.argtypes = [ctypes.c_uint64, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
    library.cuStreamCreate.argtypes = [ctypes.POINTER(ctypes.c_void_p), ctypes.c_uint]
    return library


def done(status):
    assert status == 0, f"CUDA error {status}"


DEFAULT_STREAM = 1


def new_stream():
    stream = ctypes.c_void_p()
    done(driver().cuStreamCreate(ctypes.byref(stream), 0))
    return stream.value


class CardArray:
    """Numbers on the card, written there by a stream: they are there once somebody has waited for it."""

    def __init__(self, numbers, stream=DEFAULT_STREAM, /, **changes):
        self.numbers = np.ascontiguousarray(numbers)
        self.changes = changes
        self.address = 0
        if self.numbers.nbytes:
            address = ctypes.c_uint64()
            done(driver().cuMemAlloc_v2(ctypes.byref(address), self.numbers.nbytes))
            self.address = address.value
        self.write(self.numbers, stream)

    def write(self, numbers, stream=DEFAULT_STREAM):
        self.numbers, self.stream = np.ascontiguousarray(numbers, self.numbers.dtype), stream
        bytes_ = self.numbers.tobytes()
        if bytes_:
            done(driver().cuMemcpyHtoDAsync_v2(self.address, bytes_, len(bytes_), stream))

    @property
    def __cuda_array_interface__(self):
        interface = dict(
            shape=self.numbers.shape,
            typestr=self.numbers.dtype.str,
            data=(self.address, False),
            version=3,
            strides=None,
            stream=self.stream,
        )
        interface.update(self.changes)
        return {key: value for key, value in interface.items() if value != "left out"}

    def __del__(self):
        if self.address:
            done(driver().cuMemFree_v2(self.address))


def on_host(column):
    """The numbers of a column of contacts on the card: memory of the stub is memory of this process."""
    interface = column.__cuda_array_interface__
    assert interface["version"] == 3 and interface["stream"] is None
    shape, strides = interface["shape"], interface["strides"]
    address, is_read_only = interface["data"]
    if shape[0] == 0:
        return np.zeros(shape, interface["typestr"])
    length = (shape[0] - 1) * strides[0] + 4 * (shape[1] if len(shape) == 2 else 1)
    memory = (ctypes.c_char * length).from_address(address)
    return np.ndarray(shape, interface["typestr"], memory, strides=strides).copy()
