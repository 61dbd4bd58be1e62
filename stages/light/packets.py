"""Whether anything lies along rays, asked of Embree sixteen at a time, or eight where registers are not that wide.

embreex asks ray by ray. Most rays of a surface meet nothing, and nearly all of their time is spent on the boxes around the
point where they start; rays of one point, asked together, share that, and take two thirds of the time. So who asks gives the
rays of one point, or of near ones, one after the other. The library is the one that embreex brings along and has loaded; where
the system does not let its functions be found through that (Windows), rays are asked one by one.

Source: Embree 4 API reference, `rtcOccluded16`; Benthin et al. 2012, "Combining Single and Packet-Ray Tracing for Arbitrary
Ray Distributions on the Intel MIC Architecture".
"""

import ctypes
import functools
import weakref
from typing import Any

import numpy as np
from embreex import rtcore_scene
from llvmlite import ir
from numba.core import types
from numpy.typing import NDArray

from stages.core.lanes import intrinsic
from stages.core.parallel import compiled

_HANDLE, _WORD, _SIZE = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t

_FUNCTIONS: dict[str, tuple[Any, ...]] = {  # what each returns, and takes
    "rtcNewDevice": (_HANDLE, ctypes.c_char_p),
    "rtcGetDeviceProperty": (ctypes.c_ssize_t, _HANDLE, _WORD),
    "rtcGetDeviceError": (_WORD, _HANDLE),
    "rtcNewScene": (_HANDLE, _HANDLE),
    "rtcReleaseScene": (None, _HANDLE),
    "rtcNewGeometry": (_HANDLE, _HANDLE, _WORD),
    "rtcReleaseGeometry": (None, _HANDLE),
    "rtcSetSharedGeometryBuffer": (None, _HANDLE, _WORD, _WORD, _WORD, _HANDLE, _SIZE, _SIZE, _SIZE),
    "rtcCommitGeometry": (None, _HANDLE),
    "rtcAttachGeometry": (_WORD, _HANDLE, _HANDLE),
    "rtcCommitScene": (None, _HANDLE),
    "rtcOccluded8": (None, _HANDLE, _HANDLE, _HANDLE, _HANDLE),
    "rtcOccluded16": (None, _HANDLE, _HANDLE, _HANDLE, _HANDLE),
}

_TRIANGLES, _INDICES, _VERTICES, _UINT3, _FLOAT3, _SIXTEEN_AT_ONCE = 0, 0, 1, 0x5003, 0x9003, 34
"""Embree's RTC_GEOMETRY_TYPE_TRIANGLE, RTC_BUFFER_TYPE_INDEX and _VERTEX, RTC_FORMAT_UINT3 and _FLOAT3,
RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED."""


class Packets:
    """Embree's tree over triangles, not watertight.

    Args: vertices: (V, 3). triangles: (F, 3).
    Raises: OSError where Embree is not found, MemoryError.
    """

    def __init__(self, vertices: NDArray[np.float32], triangles: NDArray[np.int32]) -> None:
        library, device = embree()
        self._kept = np.append(vertices, np.zeros((2, 3), np.float32), 0), np.ascontiguousarray(triangles, np.uint32)
        self._tree = library.rtcNewScene(device)
        weakref.finalize(self, library.rtcReleaseScene, self._tree)
        if len(triangles):
            shape = library.rtcNewGeometry(device, _TRIANGLES)
            for kind, form, array, count in (
                (_VERTICES, _FLOAT3, self._kept[0], len(vertices)),  # the last one is read with what follows it
                (_INDICES, _UINT3, self._kept[1], len(triangles)),
            ):
                library.rtcSetSharedGeometryBuffer(shape, kind, 0, form, array.ctypes.data, 0, 12, count)
            library.rtcCommitGeometry(shape)
            library.rtcAttachGeometry(self._tree, shape)
            library.rtcReleaseGeometry(shape)
        library.rtcCommitScene(self._tree)
        if library.rtcGetDeviceError(device):
            raise MemoryError(f"Embree cannot hold {len(triangles)} triangles")
        self._width = 16 if library.rtcGetDeviceProperty(device, _SIXTEEN_AT_ONCE) else 8
        call = library.rtcOccluded16 if self._width == 16 else library.rtcOccluded8
        self._call = ctypes.cast(call, _HANDLE).value

    def occluded(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32], asked: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """Whether anything lies along some of R rays, (R,); False of the others. Args: (R, 3) each. asked: rows, in turn."""
        result = np.zeros(len(origins), np.bool_)
        _occluded(self._call, self._tree, self._width, origins, directions, asked, result)
        return result


@functools.cache
def embree() -> tuple[Any, int]:
    """The library that embreex has loaded, and a device of it, which lives as long as the process. Raises: OSError."""
    library = ctypes.CDLL(rtcore_scene.__file__)  # who looks there finds what that one is linked to
    for name, (result, *arguments) in _FUNCTIONS.items():
        try:
            function = getattr(library, name)
        except AttributeError as error:
            raise OSError(str(error)) from error
        function.restype, function.argtypes = result, arguments
    return library, library.rtcNewDevice(b"")


@intrinsic
def _call(typing: Any, function: Any, valid: Any, tree: Any, rays: Any) -> Any:
    """Call `function(valid, tree, rays, NULL)`, all of them addresses."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * 4)
        given = [builder.inttoptr(arg, pointer) for arg in args[1:]]
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), [*given, ir.Constant(pointer, None)])
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, types.intp, types.intp), code


@compiled
def _occluded(call, tree, width, origins, directions, asked, result):  # type: ignore[no-untyped-def]
    """`Packets.occluded`. Args: call, tree: addresses. result: (R,), written where asked."""
    room = np.zeros(14 * width, np.float32)
    begin = -(room.ctypes.data // 4) % 16  # of a line of the cache, as Embree wants it
    rays, numbers = room[begin : begin + 12 * width], room[begin : begin + 12 * width].view(np.int32)
    valid = np.zeros(2 * width + 16, np.int32)
    valid = valid[-(valid.ctypes.data // 4) % 16 :]
    for first in range(0, len(asked), width):
        count = min(width, len(asked) - first)
        for k in range(width):
            valid[k] = -1 if k < count else 0
        for k in range(count):
            r = asked[first + k]
            for d in range(3):
                rays[d * width + k], rays[(4 + d) * width + k] = origins[r, d], directions[r, d]
            rays[8 * width + k], numbers[9 * width + k] = np.inf, -1  # as far as any, and no mask
        _call(call, valid.ctypes.data, tree, rays.ctypes.data)
        for k in range(count):
            result[asked[first + k]] = rays[8 * width + k] < 0
