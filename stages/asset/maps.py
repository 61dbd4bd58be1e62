"""What a baked material is: its maps by name."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Maps:
    """Maps over one UV layout, the first row at v = 1; linear float32. None: the material has no such map.

    material: (H, W, 5) albedo, roughness, metallic. height: (H, W), units of the object (its longest edge is 1), 0 = the
    mesh, outward positive. normal: (H, W, 3) unit, tangent space, +Y up as in glTF. occlusion: (H, W), 1 = open.
    """

    material: NDArray[np.float32]
    height: NDArray[np.float32] | None = None
    normal: NDArray[np.float32] | None = None
    occlusion: NDArray[np.float32] | None = None

    @property
    def albedo(self) -> NDArray[np.float32]:
        """(H, W, 3)."""
        return self.material[..., :3]

    @property
    def roughness(self) -> NDArray[np.float32]:
        """(H, W)."""
        return self.material[..., 3]

    @property
    def metallic(self) -> NDArray[np.float32]:
        """(H, W)."""
        return self.material[..., 4]

    def stored(self) -> "Maps":
        """The same, rounded to what the masters hold, so that every other file follows from these."""
        normal, occlusion = (None if values is None else half(values) for values in (self.normal, self.occlusion))
        return replace(self, material=half(self.material), normal=normal, occlusion=occlusion)


def half(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rounded to half floats."""
    return values.astype(np.float16).astype(np.float32)
